"""Figures, reports and the published comparison, from recordings. See README.md."""
