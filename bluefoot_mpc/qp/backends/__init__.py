"""The solvers behind the one interface; nothing else names them."""
