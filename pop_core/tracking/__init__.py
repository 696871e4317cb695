"""People over time: association, warm starts and the filter behind them."""
