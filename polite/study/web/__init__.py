"""The web application: pages for participants and the researcher, and the API of the pages."""
