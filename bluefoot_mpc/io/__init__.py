"""The robot interface, the safety supervisor, and the devices behind them."""
