"""From stored numbers to figures and one self-contained page."""
