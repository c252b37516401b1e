"""The command `./sls`: options, programs and their supervision, tables. Set-up and build are in the file `sls`.

It runs before any Debian package is installed, so its modules import the standard library alone."""
