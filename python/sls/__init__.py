"""Figures, reports and the published comparison, from recordings. See python/README.md."""
