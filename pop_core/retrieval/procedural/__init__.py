"""Poses drawn from rules: what people do with legs, trunk and arms."""
