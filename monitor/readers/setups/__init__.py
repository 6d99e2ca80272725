"""The setups of a campaign of instruments: what each states, and that they agree."""
