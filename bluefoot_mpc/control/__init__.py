"""The controller: stages in their order, modes, and the configuration of all of it."""
