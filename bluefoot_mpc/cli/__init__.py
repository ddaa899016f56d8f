"""The command line ``bluefoot``: arguments in, one page or one JSON object out, an exit status."""
