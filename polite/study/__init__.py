"""The study with people: a web page that collects preferences and highlights (extra `web`)."""
