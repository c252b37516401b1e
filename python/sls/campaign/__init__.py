"""Campaigns: one file that asks a statistical question, answered by many flights.

See config/campaigns/README.md for what a campaign file holds."""
