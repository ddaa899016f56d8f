"""Where the trunk goes so that the zero-moment point stays over the feet."""
