"""Clean Debian systems in folders: debootstrap makes one, a checkout is copied into it, commands run in it.

Each command has its own mounts, processes, /run and /dev/shm, which vanish with it, however it ends: nothing is ever
mounted where other processes see it. The network is that of this machine, because the commands install packages."""

import contextlib
import dataclasses
import fcntl
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CODENAMES = {"debian12": "bookworm", "debian13": "trixie", "testing": "testing"}  # what debootstrap calls them
ARM = "aarch64"  # a system, too: a Debian 12 that builds for ARM
CHECKOUT = "sls"  # folder of the checkout in a tree; not in /root, which other users cannot enter
BASE_DAYS = 30  # age at which a kept base is made anew
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
RESERVE_GIB = 1  # a command is stopped where less is left
# Settings with which this machine reaches mirrors and registries, if it has them.
PASSED_ON = re.compile("(https?|no|all)_proxy|npm_config_.*", re.IGNORECASE)
APT_SETTING = re.compile(r"Acquire::(https?::|Check-|ForceIPv|Retries)")
# $1 is the tree, $2 another one that it sees as OTHER, or empty; the command follows. The tree is bound to itself, because
# namespaces need a root that is a mount point.
ENTER = """set -e
mount --bind "$1" "$1"
cd "$1"
mount -t proc proc proc
mount -t sysfs sysfs sys
mount --rbind /dev dev
mount -t tmpfs -o mode=1777 tmpfs dev/shm
mount -t tmpfs -o mode=755 tmpfs run
if [ -n "$2" ]; then
  mkdir -p other
  mount --bind "$2" other
fi
tree=$1
shift 2
exec chroot "$tree" "$@"
"""


class Failure(Exception):
    """A reason why there is no tree or no result, in one line."""


class Interrupted(BaseException):
    def __init__(self, number):
        super().__init__(number)
        self.code = 128 + number


def _raise_interrupted(number, _):
    for other in SIGNALS:  # a second signal must not stop the cleaning up
        signal.signal(other, signal.SIG_IGN)
    raise Interrupted(number)


def handle_signals():
    """SIGINT, SIGTERM and SIGHUP raise Interrupted."""
    for number in SIGNALS:
        signal.signal(number, _raise_interrupted)


# --- what this machine has ------------------------------------------------------------------------


def isolate(*command):
    """The command with its own mounts and processes. If the process that starts it dies, all of them are killed."""
    return ["setpriv", "--pdeathsig", "KILL", "--", "unshare", "--mount", "--propagation", "private", "--pid", "--fork",
            "--mount-proc", "--kill-child", "--", *map(str, command)]


def check_machine():
    """@throws Failure if this machine cannot make trees."""
    if os.geteuid() != 0:
        raise Failure("expected root, which debootstrap and namespaces need: try sudo")
    for program, package in (("debootstrap", "debootstrap"), ("git", "git"), ("unshare", "util-linux")):
        if not shutil.which(program):
            raise Failure(f"{program} is missing: apt-get install {package}")
    tried = subprocess.run(isolate("true"), capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        raise Failure(f"this machine gives no namespaces: {_last_line(tried.stderr)}")


def check_disk(folder, needed_gib):
    """@throws Failure if the disk of `folder` has less than `needed_gib` free."""
    free = shutil.disk_usage(folder).free / 2**30
    if free < needed_gib:
        raise Failure(f"{folder}: expected {needed_gib:g} GiB free on this disk, got {free:.1f} GiB")


def find_mirror():
    """The mirror of Debian that apt of this machine uses."""
    try:
        said = subprocess.run(["apt-get", "indextargets", "--format", "$(CODENAME) $(SITE)", "Created-By: Packages",
                               "Origin: Debian", "Component: main"], capture_output=True, text=True, check=False).stdout
    except FileNotFoundError:
        said = ""
    sites = [line.partition(" ")[2] for line in said.splitlines() if "-" not in line.partition(" ")[0]]
    return sites[0] if sites else "http://deb.debian.org/debian"


def copy_settings(tree):
    """Gives a tree the settings with which this machine reaches its mirror and npm's registry. Returns variables."""
    for name in ("/etc/resolv.conf", "/etc/hosts", "/etc/npmrc"):
        if os.path.isfile(name):
            shutil.copy(name, f"{tree}{name}")
    if (home := pathlib.Path("~/.npmrc").expanduser()).is_file():
        shutil.copy(home, tree / "root/.npmrc")
    if shutil.which("apt-config"):
        said = subprocess.run(["apt-config", "dump", "Acquire"], capture_output=True, text=True, check=True).stdout
        kept = [line for line in said.splitlines() if APT_SETTING.match(line)]
        (tree / "etc/apt/apt.conf.d/90host").write_text("\n".join(kept) + "\n")
    # dpkg need not sync to the disk: a tree can be made again.
    (tree / "etc/dpkg/dpkg.cfg.d/no_sync").write_text("force-unsafe-io\n")
    variables = {name: value for name, value in os.environ.items() if PASSED_ON.fullmatch(name)}
    authorities = os.environ.get("npm_config_cafile") or os.environ.get("NODE_EXTRA_CA_CERTS")
    if authorities and os.path.isfile(authorities):
        shutil.copy(authorities, tree / "root/authorities.crt")
        variables |= dict.fromkeys(("NODE_EXTRA_CA_CERTS", "npm_config_cafile"), "/root/authorities.crt")
    return variables


# --- processes ------------------------------------------------------------------------------------


def _last_line(text):
    return (text.strip().splitlines() or ["it said nothing"])[-1].strip()


def _kill(process):
    """Kills the processes of isolate(). Returns when all of them are gone."""
    children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children")
    with contextlib.suppress(OSError, ValueError):
        # The first process of the new process namespace: the kernel ends the others before it.
        os.kill(int(children.read_text().split()[0]), signal.SIGKILL)
    try:
        process.wait(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def run_bounded(command, log, deadline, disk):
    """Runs a command of isolate() with its output in the file `log`; returns its exit code.

    @throws Failure after `deadline`, of time.monotonic(), and where the disk of the folder `disk` is nearly full."""
    with open(log, "wb") as output:
        # Its own session: Ctrl-C reaches this process alone, which ends the others.
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                                   start_new_session=True)
        try:
            while True:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    return process.wait(timeout=max(0.1, min(5.0, deadline - time.monotonic())))
                if time.monotonic() >= deadline:
                    raise Failure("stopped at the limit of time")
                if shutil.disk_usage(disk).free < RESERVE_GIB * 2**30:
                    raise Failure(f"stopped: less than {RESERVE_GIB} GiB is left on the disk of {disk}")
        finally:
            if process.poll() is None:
                _kill(process)


# --- trees ----------------------------------------------------------------------------------------


@contextlib.contextmanager
def lock(folder):
    """@throws Failure if another process has the lock of `folder`."""
    with open(folder / "lock", "w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Failure(f"{folder}: another ./sls systems uses this folder") from None
        yield


def remove(folder):
    """Deletes a folder and nothing on other file systems.

    @throws Failure if something is mounted in it."""
    for line in pathlib.Path("/proc/self/mountinfo").read_text(encoding="utf-8").splitlines():
        place = re.sub(r"\\(\d{3})", lambda octal: chr(int(octal[1], 8)), line.split()[4])
        if place == str(folder) or place.startswith(f"{folder}/"):
            raise Failure(f"{folder}: not deleted: something is mounted at {place}")
    subprocess.run(["rm", "-rf", "--one-file-system", "--", folder], check=True)


@dataclasses.dataclass
class Tree:
    """A clean system in a folder; also the log files of its commands, beside the folder."""

    system: str  # a key of CODENAMES, or ARM
    folder: pathlib.Path  # of all trees, absolute; the tree is a folder in it
    deadline: float  # of time.monotonic()
    other: "Tree | None" = None  # a tree in which the commands have run: tests of mixed flights use its programs

    def __post_init__(self):
        self.variables = {}

    @property
    def path(self):
        return self.folder / self.system

    @property
    def checkout(self):
        return self.path / CHECKOUT

    def log(self, name):
        return self.folder / f"{self.system}-{name}.log"

    def make(self):
        """Makes the system, from the base of an earlier call if there is one.

        @throws Failure with the reason of debootstrap, such as no network."""
        remove(self.path)
        codename = CODENAMES["debian12" if self.system == ARM else self.system]
        base = self.folder / f"{codename}.tar"
        if base.is_file() and time.time() - base.stat().st_mtime < BASE_DAYS * 86400:
            self.path.mkdir()
            self._make_here("unpacking", "tar", "-C", self.path, "-xf", base)
        else:
            self._make_here("debootstrap", "debootstrap", "--variant=minbase", codename, self.path, find_mirror())
            part = base.with_suffix(".part")
            self._make_here("packing", "tar", "-C", self.path, "-cf", part, ".")
            part.rename(base)
        self.variables = copy_settings(self.path)
        if self.system == "testing":
            # Testing loses packages for a while, as Fast DDS in November 2026: what it lacks comes from unstable.
            apt = self.path / "etc/apt"
            (apt / "sources.list.d/unstable.list").write_text(f"deb {find_mirror()} unstable main\n")
            (apt / "preferences.d/unstable").write_text("Package: *\nPin: release a=unstable\nPin-Priority: 100\n")

    def _make_here(self, name, *command):
        self.check(name, self.run_here(name, *command))
        self.log(name).unlink()

    def check(self, name, code):
        """@throws Failure with the reason in log(name) if the exit code is not 0."""
        if code != 0:
            text = self.log(name).read_text(encoding="utf-8", errors="replace")
            errors = re.findall("^E: .*", text, re.MULTILINE)
            raise Failure(f"{name} failed: {errors[0] if errors else _last_line(text)} (log: {self.log(name)})")

    def run_here(self, name, *command):
        """Runs a command on this machine with its own mounts and processes; otherwise as run()."""
        return run_bounded(isolate(*command), self.log(name), self.deadline, self.folder)

    def copy_checkout(self):
        """Clones HEAD of this checkout and repeats what has changed since. Returns the commit in words.

        @throws Failure if this is no checkout of git."""

        def git(*words):
            done = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise Failure(f"{ROOT}: expected a checkout of git: {_last_line(done.stderr)}")
            return done.stdout

        git("clone", "--quiet", "--no-hardlinks", ROOT, self.checkout)
        changed = set(git("ls-files", "-z", "--modified", "--others", "--exclude-standard").split("\0")) - {""}
        changed |= set(git("diff", "-z", "--name-only", "--cached").split("\0")) - {""}
        for name in sorted(changed):
            source, copy = ROOT / name, self.checkout / name
            if source.is_file():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, copy)
            else:
                copy.unlink(missing_ok=True)
        return git("rev-parse", "--short", "HEAD").strip() + (f" and {len(changed)} changed files" if changed else "")

    def run(self, name, *command):
        """Runs a command in the checkout; its output goes to log(name). Returns its exit code.

        @throws Failure at the limits of run_bounded."""
        variables = {"HOME": "/root", "LANG": "C.UTF-8", "TERM": "dumb", "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:"
                     "/usr/bin:/sbin:/bin", **self.variables}
        if self.other:
            variables |= {"SLS_OTHER_TREE": "/other", "SLS_OTHER_BUILD": f"/other/{CHECKOUT}/build"}
        # The first process of a process namespace must wait for those that lose their parents: bash does.
        inside = ["env", "-i", *(f"{key}={value}" for key, value in variables.items()), "bash", "-c",
                  'cd "$0" && "$@"; exit $?', f"/{CHECKOUT}", *command]
        return self.run_here(name, "sh", "-c", ENTER, "sh", self.path, self.other.path if self.other else "", *inside)

    def ask(self, command):
        """What a short command prints in the tree, in one line; "?" if it fails."""
        code = dataclasses.replace(self, deadline=time.monotonic() + 60).run("ask", "sh", "-c", command)
        said = self.log("ask").read_text(encoding="utf-8", errors="replace").split()
        self.log("ask").unlink()
        return " ".join(said) if code == 0 and said else "?"
