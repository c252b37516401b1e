"""Campaigns: one file describes many flights, which answer a statistical question.

config/campaigns/README.md describes the campaign file."""
