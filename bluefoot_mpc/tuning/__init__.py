"""Finding parameters: what is searched, over which runs, judged by what."""
