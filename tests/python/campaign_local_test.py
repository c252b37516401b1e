"""The local engine and the command line, with runs that take no time: the flown chunks, killed workers, full
disks, and Ctrl-C."""

import csv
import io
import json
import math
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

from campaign_engine_support import BASE, FAKE, CampaignTest

sys.path.insert(0, str(FAKE))


class LocalEngineTest(CampaignTest):
    def setUp(self):
        super().setUp()
        self.write_campaign(40)

    def work(self, *arguments, code=0):
        done = subprocess.run([sys.executable, "-BP", "-m", "sls.campaign.worker", "out", *arguments], cwd=self.folder,
                              text=True, capture_output=True, env=self.environment())
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def test_the_table_has_every_run_in_order_and_measures_by_formula(self):
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 7)
        rows = list(csv.DictReader(io.StringIO(self.read_table("out").decode())))
        self.assertEqual([row["run"] for row in rows], [str(run) for run in range(40)])
        for row in rows:
            mass = float(row["vehicle.load_mass_kg"])
            self.assertEqual(row["faults.0.noise.seed"], row["run"])
            self.assertEqual(float(row["load_error_rms_m"]), math.sqrt(mass))
            self.assertEqual(row["outcome"], "lost" if mass > 0.3 else "finished")
            self.assertEqual(row["reason"], "load more than 1 m, further from its reference"
                             if mass > 0.3 else "")
            self.assertEqual(row["load_error_max_m"], "" if mass > 0.3 else row["vehicle.load_mass_kg"])
            self.assertEqual(len(row["certificate"]), 64)
        manifest = json.loads((self.folder / "out/manifest.json").read_text())
        self.assertTrue(manifest["complete"])
        lost = sum(row["outcome"] == "lost" for row in rows)
        self.assertEqual(manifest["outcomes"], {"finished": 40 - lost, "lost": lost})
        self.assertTrue((self.folder / "out/report.html").read_text().startswith("<!"))

    def test_tables_are_the_same_bytes_for_any_number_of_workers_and_size_of_chunk(self):
        self.write_campaign(60)
        tables = []
        for workers, chunk_runs in ((1, 60), (2, 7), (4, 1)):
            out = f"out{workers}"
            self.fly("campaign.yaml", "--out", out, "--workers", workers, "--chunk-runs", chunk_runs)
            tables.append(self.read_table(out))
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])

    def test_runs_a_to_b_are_rows_of_the_whole_table(self):
        self.write_campaign(30)
        self.fly("campaign.yaml", "--out", "all")
        self.fly("campaign.yaml", "--out", "some", "--runs", "10-19")
        lines = self.read_table("all").splitlines()
        self.assertEqual(self.read_table("some").splitlines(), [lines[0], *lines[11:21]])
        self.assertFalse(json.loads((self.folder / "some/manifest.json").read_text())["complete"])
        self.expect_line(self.fly("campaign.yaml", "--out", "x", "--runs", "10-30", code=2),
                         "--runs: expected runs from 0 to 29, got 10-30")

    def test_a_tenth_of_the_workers_killed_at_random_changes_nothing(self):
        self.fly_whole(200)
        flying = self.folder / "flying"
        flying.mkdir()
        process = self.start("campaign.yaml", "--out", "killed", "--workers", 3, "--chunk-runs", 5,
                             fake=f"sleep=0.01 note={flying} hold=190:{self.folder / 'all-killed'}")
        dice = random.Random(7)
        for chunks in range(2, 38, 8):  # kills a worker at 5 of 40 chunks
            self.wait_until(lambda: self.count_chunks("killed") >= chunks, process)
            # Three ends before the first run would end the campaign: only workers that fly are killed.
            workers = [worker for worker in self.list_workers(process) if (flying / str(worker)).exists()]
            os.kill(dice.choice(workers), signal.SIGKILL)
        (self.folder / "all-killed").touch()
        said = process.communicate(timeout=240)[1]
        self.assertEqual(process.returncode, 0, said)
        self.assertEqual(self.read_table("killed"), self.read_table("whole"))

    def test_a_killed_campaign_is_resumed_to_the_same_bytes_and_leaves_no_process(self):
        self.fly_whole(200)
        process = self.start("campaign.yaml", "--out", "killed", "--workers", 2, "--chunk-runs", 5,
                             fake="sleep=0.01")
        self.wait_until(lambda: self.count_chunks("killed") >= 5, process)
        workers = self.list_workers(process)
        process.kill()
        process.communicate(timeout=60)
        self.wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))
        before = self.count_chunks("killed")
        self.assertLess(before, 40)
        files = {file: file.stat().st_mtime_ns
                 for file in (self.folder / "killed/chunks").glob("chunk-*.csv")}
        self.expect_line(self.fly("campaign.yaml", "--out", "killed", code=2),
                         "killed", "--resume flies what is missing")
        self.fly("campaign.yaml", "--out", "killed", "--resume")
        self.assertEqual(self.read_table("killed"), self.read_table("whole"))
        for file, time_ns in files.items():  # existing chunks were not flown again
            self.assertEqual(file.stat().st_mtime_ns, time_ns)
        self.assertEqual(list((self.folder / "killed/chunks").glob("*.tmp")), [])

    def test_ctrl_c_leaves_a_folder_that_resumes(self):
        from sls.campaign.whole_files import name_place

        self.fly_whole(200)
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            out = f"stopped-{code}"
            process = self.start("campaign.yaml", "--out", out, "--workers", 2, "--chunk-runs", 5,
                                 fake="sleep=0.01")
            chunks = self.folder / out / "chunks"
            self.wait_until(lambda: self.count_chunks(out) >= 3, process)
            workers = self.list_workers(process)
            # As of a worker that ends while it writes: where the disk is fast, no other exists for long.
            ended = subprocess.Popen(["true"])
            ended.wait()
            (chunks / f".chunk-000039.csv.{name_place()}.{ended.pid}.tmp").touch()
            process.send_signal(number)
            said = process.communicate(timeout=60)[1]
            self.assertEqual(process.returncode, code, said)
            self.assertEqual(said.count("\n"), 1, said)
            self.assertRegex(said, r"interrupted with \d+ of 40 chunks flown; to go on: ./sls campaign "
                                   rf"campaign.yaml --out {out} --resume")
            self.assertFalse(any(Path(f"/proc/{worker}").exists() for worker in workers))
            self.assertEqual(list(chunks.glob(".*")), [])
            self.fly("campaign.yaml", "--out", out, "--resume")
            self.assertEqual(self.read_table(out), self.read_table("whole"))

    def test_damaged_chunks_are_flown_again(self):
        self.write_campaign(60)
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 10)
        table = self.read_table("out")
        chunks = self.folder / "out/chunks"
        flipped = bytearray((chunks / "chunk-000001.csv").read_bytes())
        flipped[len(flipped) // 3] ^= 1
        (chunks / "chunk-000001.csv").write_bytes(flipped)
        (chunks / "chunk-000002.csv").write_bytes((chunks / "chunk-000003.csv").read_bytes())
        cut = (chunks / "chunk-000004.csv").read_bytes()
        (chunks / "chunk-000004.csv").write_bytes(cut[:len(cut) // 2])
        (chunks / "chunk-000005.csv").unlink()
        (self.folder / "out/runs.csv").unlink()
        status = self.fly("status", "out")
        for part in ("2 flown, 1 missing, 3 damaged", "1 (checksum does not fit)",
                     "2 (of another campaign or other runs)", "missing   5"):
            self.assertIn(part, status)
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertEqual(self.read_table("out"), table)
        self.assertIn("6 flown, 0 missing, 0 damaged", self.fly("status", "out"))

    def test_the_output_of_a_run_goes_to_stderr_and_changes_nothing(self):
        self.fly_whole()
        said = self.fly_apart("campaign.yaml", "--out", "out", "--chunk-runs", 5, fake="print=1")
        self.assertIn("printed by a library\n", said)
        self.assertEqual(self.read_table("out"), self.read_table("whole"))

    def test_a_run_that_kills_its_worker_once_is_flown_again(self):
        self.fly_whole()
        marker = self.folder / "marker"
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5, fake=f"kill-once=17:{marker}")
        self.assertTrue(marker.exists())
        self.assertEqual(self.read_table("out"), self.read_table("whole"))

    def test_a_run_that_kills_its_worker_each_time_is_named_when_all_others_are_flown(self):
        said = self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5, fake="kill=17", code=1)
        self.expect_line(said, "chunk-000003.csv", "SIGKILL", "in run 17", "tried 3 times")
        self.assertEqual(self.count_chunks("out"), 7)

    def test_a_run_that_is_refused_in_flight_ends_the_campaign_and_is_named(self):
        said = self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5, fake="refuse=17", code=2)
        self.expect_line(said, "run 17: base.yaml:2: vehicle.load_mass_kg: expected > 0")

    def test_other_bytes_of_a_chunk_that_is_there_are_an_error_that_names_the_run(self):
        from sls.campaign.engines import EngineError
        from sls.campaign.folder import CampaignFolder
        self.write_campaign(20)
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        folder = CampaignFolder(self.folder / "out")
        rows = folder.read_chunk(2)
        file = folder.chunk_file(2)
        before = file.read_bytes()
        folder.write_chunk(2, rows)  # as from a second flight of the chunk
        self.assertEqual(file.read_bytes(), before)
        rows[3][-1] = "0" * 64
        with self.assertRaises(EngineError) as raised:
            folder.write_chunk(2, rows)
        self.assertIn("chunk-000002.csv", str(raised.exception))
        self.assertIn("first of run 13", str(raised.exception))
        self.assertEqual(file.read_bytes(), before)

    def test_a_folder_of_another_campaign_or_in_use_is_refused(self):
        self.fly("campaign.yaml", "--out", "out")
        self.write_campaign(41, name="other.yaml")
        said = self.fly("other.yaml", "--out", "out", "--resume", code=2)
        plan = json.loads((self.folder / "out/plan.json").read_text())
        self.expect_line(said, "out: expected a folder of campaign 'other'", plan["sha256"])
        process = self.start("campaign.yaml", "--out", "busy", "--chunk-runs", 5, fake="sleep=0.05")
        self.wait_until(lambda: self.count_chunks("busy") >= 1, process)
        said = self.fly("campaign.yaml", "--out", "busy", "--resume", code=2)
        self.expect_line(said, "in use by process", process.pid)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.write("mine/letter.txt", "dear")
        said = self.fly("campaign.yaml", "--out", "mine", code=2)
        self.expect_line(said, "mine: expected a new or empty folder, got one that holds 'letter.txt'")
        self.assertEqual(os.listdir(self.folder / "mine"), ["letter.txt"])

    def test_resume_waits_for_a_collect_job_alone(self):
        from sls.campaign.folder import COLLECT_JOB, CampaignFolder
        from sls.input_error import InputError
        for owner, waits in ((COLLECT_JOB, True), ("", False)):
            with self.subTest(owner=owner):
                first, second = CampaignFolder(self.folder), CampaignFolder(self.folder)
                first.take_lock(owner)
                with unittest.mock.patch("sls.campaign.folder.time.sleep", lambda _: first.close()):
                    if waits:
                        second.take_lock(patience_s=60.0)
                        first = second
                    else:
                        with self.assertRaisesRegex(InputError, f"in use by process {os.getpid()} on "):
                            second.take_lock(patience_s=60.0)
                with self.assertRaisesRegex(InputError, "in use by process"):
                    CampaignFolder(self.folder).take_lock()
                first.close()

    def test_another_kind_of_machine_is_refused_unless_allowed_and_then_named(self):
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        plan_file = self.folder / "out/plan.json"
        plan = json.loads(plan_file.read_text())
        plan["machine"]["level"] = "x86-64-v9"
        plan_file.write_text(json.dumps(plan))
        (self.folder / "out/chunks/chunk-000001.csv").unlink()
        said = self.fly("campaign.yaml", "--out", "out", "--resume", code=2)
        self.expect_line(said, "level: expected x86-64-v9, got ", "--allow-other-machines")
        self.fly("campaign.yaml", "--out", "out", "--resume", "--allow-other-machines")
        manifest = json.loads((self.folder / "out/manifest.json").read_text())
        self.assertTrue(manifest["other_machines"])

    def test_a_host_of_two_descriptions_is_two_machines(self):
        from sls.campaign.collect import collect
        from sls.campaign.folder import opened
        from sls.campaign.machine import host_name
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        with opened(self.folder / "out") as folder:
            rows = folder.read_chunk(7)
            folder.chunk_file(7).unlink()
            with unittest.mock.patch("sls.campaign.folder.describe_machine",
                                     return_value={**folder.plan.machine, "level": "x86-64-v9"}):
                folder.write_chunk(7, rows)
            collect(folder, "local")
            self.assertTrue(folder.manifest["other_machines"])
            machines = folder.manifest["machines"]
        self.assertEqual(sorted(machines), [host_name(), f"{host_name()} (2)"])
        self.assertEqual(sorted((machine["chunks"], machine["level"] == "x86-64-v9")
                                for machine in machines.values()), [(1, True), (7, False)])

    def test_a_c_library_that_is_told_to_use_other_instructions_is_another_machine(self):
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        (self.folder / "out/chunks/chunk-000001.csv").unlink()
        with unittest.mock.patch.dict(os.environ, GLIBC_TUNABLES="glibc.cpu.hwcaps=-FMA"):
            said = self.fly("campaign.yaml", "--out", "out", "--resume", code=2)
        self.expect_line(said, "tunables: expected none, got glibc.cpu.hwcaps=-FMA")

    def test_a_rebuilt_library_is_refused_until_its_bytes_are_those_of_the_plan(self):
        self.write("base.yaml", BASE + "controller: { law: libraries/law.so }\n")
        self.write("libraries/law.so", "built")
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        table = self.read_table("out")
        (self.folder / "out/chunks/chunk-000001.csv").unlink()
        self.write("libraries/law.so", "rebuilt")
        said = self.fly("campaign.yaml", "--out", "out", "--resume", code=2)
        self.expect_line(said, "libraries/law.so: expected the file with which the campaign was begun (sha256 ")
        self.assertIn("law.so: expected the file with which", self.work("--chunks", "1", code=2))
        self.write("libraries/law.so", "built")
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertEqual(self.read_table("out"), table)

    def test_levels_follow_the_flags_of_the_processor(self):
        from sls.campaign.machine import LEVEL_FLAGS, calc_level
        flags = set()
        self.assertEqual(calc_level("x86_64", flags), "x86-64-v1")
        for level, needed in LEVEL_FLAGS:
            flags |= needed
            self.assertEqual(calc_level("x86_64", flags), level)
        self.assertEqual(calc_level("x86_64", flags - {"popcnt"}), "x86-64-v1")
        self.assertEqual(calc_level("aarch64", set()), "aarch64")

    def test_mistakes_of_the_command_line_are_one_line(self):
        for arguments, part in (
                (("campaign.yaml", "--on", "clouds"), "--on: expected one of local, slurm, dask"),
                (("nowhere",), "config/campaigns/nowhere.yaml"),
                (("campaign.yaml", "--resume"), "--resume: expected --out DIR"),
                (("campaign.yaml", "--workers", "0"), "--workers: expected a whole number"),
                (("campaign.yaml", "--runs", "9-3"), "--runs: expected A-B"),
                (("campaign.yaml", "--chunk-runs", "0"), "--chunk-runs: expected a whole number"),
                (("status", "."), "plan.json")):
            self.expect_line(self.fly(*arguments, code=2), part)

    def test_a_value_that_no_run_could_have_is_refused_with_its_run_before_anything_flies(self):
        self.write("base.yaml", BASE)
        self.write("campaign.yaml", "base: base.yaml\nruns: 4\nvary:\n  vehicle.load_mass_kg: "
                                    "{ list: [0.2, -0.1] }\nseeds: [faults.0.noise.seed]\n")
        said = self.fly("campaign.yaml", "--out", "out", code=2)
        self.expect_line(said, "campaign.yaml:4: vary.vehicle.load_mass_kg: run 1")
        self.assertFalse((self.folder / "out").exists())

    def test_keep_by_a_column_that_no_run_measures_is_refused_before_anything_flies(self):
        self.write_campaign(40, "keep: { worst: 2, by: load_error_max_of_all }\n")
        said = self.fly("campaign.yaml", "--out", "out", code=2)
        self.expect_line(said, "campaign.yaml:7: keep.by: expected a measured column, such as load_error_max_m",
                         ", got load_error_max_of_all")
        self.assertFalse((self.folder / "out").exists())

    def test_worker_flies_listed_chunks(self):
        self.fly_whole()
        self.fly("campaign.yaml", "--out", "out", "--chunk-runs", 5)
        for file in (self.folder / "out/chunks").glob("*.csv"):
            file.unlink()
        self.work("--chunks", "0-3")
        self.assertEqual(self.count_chunks("out"), 4)
        self.assertIn("expected a chunk from 0 to 7, got 8", self.work("--chunks", "8", code=2))
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertEqual(self.read_table("out"), self.read_table("whole"))


class SharedFolderTest(CampaignTest):
    """Folders on a shared file system, and containers."""

    def test_a_file_that_nfs_shows_after_a_minute_is_waited_for_in_the_last_try(self):
        from sls.campaign.engines import cluster
        from sls.campaign.folder import CampaignFolder
        folder, clock = CampaignFolder(self.folder), [0.0]
        (self.folder / "chunks").mkdir()
        with (unittest.mock.patch.object(cluster.time, "monotonic", lambda: clock[0]),
              unittest.mock.patch.object(cluster.time, "sleep",
                                         lambda seconds: clock.__setitem__(0, clock[0] + seconds)),
              unittest.mock.patch.object(folder, "missing", lambda: [] if clock[0] > 60 else [3])):
            self.assertEqual(cluster.find_missing(folder, is_last_try=False), [3])
            self.assertEqual(cluster.find_missing(folder), [])
        self.assertEqual(list((self.folder / "chunks").iterdir()), [])

    def test_temporary_files_of_a_container_with_this_host_name_are_others(self):
        program = ("import pathlib, sys; from sls.campaign.whole_files import *; "
                   "mine = name_temporary(pathlib.Path('x')); print(mine); mine.touch(); "
                   "print([is_left_over(pathlib.Path(other)) for other in sys.argv[1:]])")
        from sls.campaign.whole_files import is_left_over, name_temporary
        ours = name_temporary(self.folder / "x")
        ours.touch()
        done = subprocess.run(["unshare", "--pid", "--fork", "--mount-proc", sys.executable, "-BP", "-c",
                               program, ours.name], cwd=self.folder, env=self.environment(),
                              capture_output=True, text=True)
        if "unshare" in done.stderr:
            self.skipTest(f"expected root to make a PID namespace: {done.stderr.strip()}")
        theirs, left_over = done.stdout.splitlines()
        self.assertEqual(left_over, "[False]")  # our process does not exist there, but lives
        self.assertFalse(is_left_over(self.folder / theirs))

    def test_a_campaign_of_any_name_has_a_name_for_its_jobs(self):
        from sls.campaign.engines import slurm
        from sls.campaign.folder import CampaignFolder
        self.write_campaign(40, name="a,b c'.yaml")
        self.fly("a,b c'.yaml", "--out", "out")
        self.assertRegex(slurm.name_job(CampaignFolder(self.folder / "out")), r"^sls-a_b_c_-[0-9a-f]{8}$")
        self.assertIn("./sls campaign &#x27;", (self.folder / "out/report.html").read_text())


class FullDiskTest(CampaignTest):
    def limit_files(self, limit):
        def apply():
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a write fails with EFBIG, as on a full disk
        return apply

    def test_a_chunk_that_does_not_fit_is_one_line_and_leaves_nothing_that_looks_whole(self):
        self.fly_whole(400)
        process = self.start("campaign.yaml", "--out", "out", "--chunk-runs", 100,
                             preexec_fn=self.limit_files(8000))  # a chunk has about 15,000 bytes
        said = process.communicate(timeout=120)[1]
        self.assertEqual(process.returncode, 1, said)
        self.expect_line(said, "chunks/chunk-00000", "expected to write it, got: File too large")
        self.assertEqual(os.listdir(self.folder / "out/chunks"), [])
        self.fly("campaign.yaml", "--out", "out", "--resume")
        self.assertEqual(self.read_table("out"), self.read_table("whole"))

    def test_a_full_disk_is_one_line_that_names_the_file_and_the_folder_resumes(self):
        disk = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, disk)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk],
                          capture_output=True).returncode:
            self.skipTest("expected root to mount a small disk")
        self.addCleanup(subprocess.run, ["umount", disk], check=True)
        self.fly_whole(400)
        said = self.fly("campaign.yaml", "--out", disk / "out", "--chunk-runs", 40, code=1)
        self.expect_line(said, disk, "expected to write it, got: No space left on device")
        self.assertEqual(list((disk / "out/chunks").glob(".*")), [])
        subprocess.run(["mount", "-o", "remount,size=4m", disk], check=True)
        self.fly("campaign.yaml", "--out", disk / "out", "--resume")
        self.assertEqual((disk / "out/runs.csv").read_bytes(), self.read_table("whole"))


class ManyRunsTest(CampaignTest):
    def test_no_process_needs_300_mb_for_100_000_runs(self):
        self.write_campaign(100_000)
        process = self.start("campaign.yaml", "--out", "out", "--workers", 2)
        largest = 0

        def is_over():
            nonlocal largest
            for number in [process.pid, *self.list_workers(process)]:
                largest = max(largest, read_peak_mb(number))
            return process.poll() is not None
        try:
            self.wait_until(is_over)
        except FileNotFoundError:  # the process has ended between two reads of /proc
            pass
        said = process.communicate(timeout=60)[1]
        self.assertEqual(process.returncode, 0, said)
        self.assertEqual(self.read_table("out").count(b"\n"), 100_001)
        print(f"largest process: {largest:.0f} MB", file=sys.stderr)
        self.assertLess(largest, 300)


def read_peak_mb(process):
    """Peak of the resident memory, MB."""
    try:
        for line in Path(f"/proc/{process}/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return int(line.split()[1]) / 1024
    except (FileNotFoundError, ProcessLookupError):
        pass
    return 0.0
