"""The base of tests that need a folder of their own."""

import pathlib
import tempfile
import unittest


class FolderTest(unittest.TestCase):
    """A test with its own folder."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())).resolve()

    def write(self, name, text, mode=0o644):
        """Writes a file below the folder, and returns its path."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(mode)
        return path
