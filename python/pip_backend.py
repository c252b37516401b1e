"""Makes the wheel of the package `sls`, with its extension module, the programs, the folder config and the command
`sls`: for pip (PEP 517), and as `pip_backend.py DIR` for the Debian package."""

import base64
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))
from sls.launcher.building import PROGRAMS  # noqa: E402
MODULE = f"_sls_core{sysconfig.get_config_var('EXT_SUFFIX')}"
DATE = (1980, 1, 1, 0, 0, 0)  # equal sources make equal wheels


def find_build() -> Path:
    """A build tree with the programs and with the module for this Python: SLS_BUILD, or one that is built here."""
    given = Path(os.environ.get("SLS_BUILD", "none"))
    if all((given / file).is_file() for file in (f"python/{MODULE}", *(f"bin/{name}" for name in PROGRAMS))):
        return given
    python = getattr(sys, "_base_executable", sys.executable)
    build = ROOT / ("build" if (ROOT / "build/python" / MODULE).is_file() else f"build-{sys.implementation.cache_tag}")
    commands = [["cmake", "--build", build, "--target", "_sls_core", *PROGRAMS]]
    if not (build / "CMakeCache.txt").is_file():
        commands.insert(0, ["cmake", "--preset", "release", "-B", build, "-DSLS_BUILD_TESTS=OFF",
                            f"-DPython_EXECUTABLE={python}"])
    try:
        for command in commands:
            subprocess.run(command, cwd=ROOT, check=True, stdout=sys.stderr)
    except (OSError, subprocess.CalledProcessError) as error:
        sys.exit(f"sls: error: programs and module were not built (./sls setup installs what this needs): {error}")
    return build


def list_files(build: Path) -> "list[tuple[str, Path]]":
    """The files of the wheel, with their paths in it."""
    files = [(file.relative_to(HERE).as_posix(), file) for file in (HERE / "sls").rglob("*")
             if "__pycache__" not in file.parts]
    files += [(f"sls/{file.relative_to(ROOT).as_posix()}", file) for file in (ROOT / "config").rglob("*")]
    files += [(f"sls/bin/{name}", build / "bin" / name) for name in PROGRAMS]
    files.append((MODULE, build / "python" / MODULE))
    return sorted((name, file) for name, file in files if not file.is_dir())


def build_wheel(wheel_directory: str, config_settings: object = None, metadata_directory: object = None) -> str:
    """Writes the wheel into `wheel_directory` and returns its name."""
    found = re.search(r"project\(sls VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))
    assert found, "expected the version in CMakeLists.txt"
    version, info = found[1], f"sls-{found[1]}.dist-info"
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
    entries = [(path, file.read_bytes(), file.stat().st_mode) for path, file in list_files(find_build())]
    entries += [(f"{info}/{file}", text.encode(), 0o100644) for file, text in (
        ("METADATA", f"Metadata-Version: 2.1\nName: sls\nVersion: {version}\n"
         f"Summary: Flights of a multirotor with a slung load\nRequires-Python: ~=3.{sys.version_info.minor}.0\n"
         "Requires-Dist: numpy\nRequires-Dist: PyYAML\nProvides-Extra: figures\n"
         "Requires-Dist: scipy; extra == 'figures'\nRequires-Dist: matplotlib; extra == 'figures'\n"),
        ("WHEEL", f"Wheel-Version: 1.0\nGenerator: sls\nRoot-Is-Purelib: false\nTag: {tag}\n"),
        ("entry_points.txt", "[console_scripts]\nsls = sls.launcher.__main__:start\n"
         "[pytest11]\nsls.pytest_plugin = sls.pytest_plugin\n"))]
    name = f"sls-{version}-{tag}.whl"
    record = ""
    with zipfile.ZipFile(Path(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data, mode in entries:
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
            entry = zipfile.ZipInfo(path, DATE)
            entry.external_attr = mode << 16  # pip keeps what may be executed
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
        wheel.writestr(zipfile.ZipInfo(f"{info}/RECORD", DATE), record + f"{info}/RECORD,,\n")
    return name


if __name__ == "__main__":
    build_wheel(sys.argv[1])
