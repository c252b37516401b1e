"""`./sls bench`: measures the speed of each part and its bound. See README.md."""
