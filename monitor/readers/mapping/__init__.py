"""From files as instruments write them to the rows of a campaign, by what ``mapping.toml`` says of their columns."""
