"""`./sls bench`: how fast everything is, beside how fast it could be. See README.md."""
