"""`python -m polite`: the command line, where its script is not on the path."""

from polite.cli import main

if __name__ == "__main__":
    main()
