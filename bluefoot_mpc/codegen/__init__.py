"""CasADi functions as compiled C, built once and cached, where a compiler exists."""
