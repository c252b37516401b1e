"""Puts defects into the cores, one at a time, and says which the worlds and the scripts of the cores find.

    python3 -B tests/worlds/mutants.py [--build FOLDER] [--seeds N] [--only TEXT] [--no-scripts]
    python3 -B tests/worlds/mutants.py --check

Each mutant is one change of one line. It is found by the worlds if one of the first N seeds fails, and by the scripts
if one of the cores' test programs fails, hangs or does not end. The table is printed as Markdown."""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPTS = ("sync_test", "client_core_test", "recorder_core_test", "server_core_test")
LIMIT_S = 900

# File, text (once in it), what takes its place, what is wrong then.
MUTANTS = [
    # --- servers and members
    ("common/sync/membership.hpp", "seconds(2)", "seconds(20)", "the dead are presumed dead after 20 s"),
    ("common/sync/membership.hpp", "now - heard > kPresumedDeadAfter", "false", "nobody is ever silent"),
    ("common/sync/membership.cpp", "  heard.time = arrival.time;\n", "", "repeated announcements are no sign of life"),
    ("common/sync/membership.cpp", "  ++version_;\n}", "}", "no announcement is news"),
    ("common/sync/membership.cpp", "member.announcement.done() || member.is_silent(now)", "member.announcement.done()",
     "the dead recorder is waited for"),
    ("common/sync/membership.cpp", "announcement.run_id() == run_id && announcement.done()", "announcement.done()",
     "recorders of other runs count as done"),
    ("common/sync/membership.cpp", "announcement.run_id() == run_id;", "true;", "members of other runs are found"),
    ("common/sync/servers.cpp", "  heard.time = now;\n", "", "a status is no sign of life"),
    ("common/sync/servers.cpp", "  heard.status = sample;\n", "  if (heard.status.run_id() == 0) heard.status = sample;\n",
     "only the first status counts"),
    ("common/sync/servers.cpp", "if (!run.status || progress < 0 ||", "if (progress < 0 ||", "runs are joined before their claim"),
    ("common/sync/servers.cpp", "if (!run.status || progress < 0 ||", "if (!run.status ||", "ended runs are joined"),
    ("common/sync/servers.cpp", "if (is_own || (is_dead && is_new)) successors", "if (is_own) successors", "no other server replaces one"),
    ("common/sync/servers.cpp", "if (is_own || (is_dead && is_new)) successors", "if (is_dead && is_new) successors", "a reset is not followed"),
    ("common/sync/servers.cpp", "(is_dead && is_new)", "is_new", "a living server is replaced"),
    ("common/sync/servers.cpp", "(is_dead && is_new)", "is_dead", "a server that was there before is a replacement"),
    ("common/sync/servers.cpp", "if (other.parameters->run_id() == run_id) continue;", "", "a run is its own successor"),
    ("common/app/awake_clock.hpp", "if (time - due_ > kLongestLook.count()) note_stop(time);", "",
     "the time in which a program was stopped counts as silence"),
    ("common/sync/server_watch.cpp", "heard_ = std::max(heard_, heard.value_or(heard_));", "", "the server is never heard"),
    ("common/sync/server_watch.cpp", "if (wait_->is_over(now)) return Finding::kLost;", "", "no server is ever lost"),
    ("common/sync/server_watch.cpp", "    wait_.reset();\n    return Finding::kThere;", "    return Finding::kThere;",
     "silences of a server add up"),
    ("sim_server/core/leaving.cpp", "if (wait_.is_over(now) || longest_.is_over(now)) {", "if (false) {", "recorders are waited for forever"),
    ("sim_server/core/leaving.cpp", "around.done < expected_", "around.done <= expected_", "one recorder more is waited for at the end"),
    ("sim_server/core/leaving.cpp", "if (sync::are_recorders_done(around.recorders, now) && !is_expected_missing) return true;", "return true;",
     "no recorder is waited for at the end"),
    ("common/sync/patience.hpp", "return now >= deadline_;", "return false;", "patience never ends"),
    ("common/sync/patience.hpp", "deadline_ += rest;", "", "a rest counts as waiting"),
    # --- client
    ("control_client/core/client_core.cpp", "is_ready_ || !now.sees_server", "is_ready_", "a client is ready before it sees its server"),
    ("control_client/core/client_core.cpp", "if (is_ready_ || !now.sees_server) return Act::kNone;", "return Act::kNone;", "a client is never ready"),
    ("control_client/core/client_core.cpp", "  is_ready_ = false;\n", "", "a client stays ready in the next run"),
    ("control_client/core/client_core.cpp", "if (finding == sync::ServerWatch::Finding::kLost)", "if (false)", "a client waits forever for a dead server"),
    ("control_client/core/client_core.cpp", "status->phase() == RunPhase::PHASE_FINISHED", "status->phase() == RunPhase::PHASE_RUNNING",
     "a client leaves a running flight"),
    ("control_client/core/client_core.cpp", "if (status && status->phase() == RunPhase::PHASE_FINISHED) return end(Act::kLeave);", "",
     "a client does not hear the end"),
    ("control_client/core/client_core.cpp", "!is_reset && !options_.follows_servers", "!is_reset", "--follow does nothing"),
    ("control_client/core/client_core.cpp", "!is_reset && !options_.follows_servers", "!options_.follows_servers", "a client ends with a reset"),
    ("control_client/answerer.cpp", "if (pilot.last_step == step) return pilot.last_command;", "if (pilot.last_step) return pilot.last_command;",
     "a client always gives its first answer"),
    ("control_client/answerer.cpp", "answers_.step(sample.step());", "answers_.step(sample.step() + 1);", "answers are for the next step"),
    # --- the server's claim and start
    ("sim_server/core/participants/claim.cpp", "others_progress > progress ||", "others_progress >= progress ||", "of two equal servers both yield"),
    ("sim_server/core/participants/claim.cpp", "other.parameters.run_id() < run_id))", "other.parameters.run_id() > run_id))", "of two servers the wrong one yields"),
    ("sim_server/core/participants/claim.cpp", "others_progress > progress ||", "", "a server does not yield to a further one"),
    ("sim_server/core/participants/claim.cpp", "    if (others_progress > progress ||\n        (others_progress == progress && other.parameters.run_id() < run_id))", "    if (false)",
     "no server yields"),
    ("sim_server/core/participants/claim.hpp", "return listened >= kClaimTime ||", "return true || listened >= kClaimTime ||", "a server does not listen"),
    ("sim_server/core/participants/claim.hpp", "is_on_this_machine && has_heard_every_claim)", "is_on_this_machine)", "claims of others are not waited for"),
    ("sim_server/core/participants/preparation.cpp", "std::runtime_error(rival + around.describe_other_flight())", "std::runtime_error(\"\")", "a server that yields says no reason"),
    ("sim_server/core/participants/gathering.cpp", "if (missing_.empty()) return Finding::kReady;", "return Finding::kReady;", "the flight begins without its participants"),
    ("sim_server/core/participants/gathering.cpp", "patience_.is_over(now) ? Finding::kGivenUp : Finding::kMissing", "Finding::kMissing", "missing participants are waited for forever"),
    ("sim_server/core/participants/roster.cpp", "if (ready < expected.controllers) without.push_back(id);", "", "no controller is waited for"),
    ("sim_server/core/participants/roster.cpp", "if (recorders < expected.recorders)", "if (false)", "no recorder is waited for at the start"),
    ("sim_server/core/participants/roster.cpp", "entry.announcement.ready() && entry.announcement.scenario_sha256() == scenario_sha256 &&", "entry.announcement.ready() &&",
     "a client with another scenario may answer"),
    ("sim_server/core/participants/roster.cpp", "if (entry.announcement.ready() && entry.announcement.scenario_sha256()", "if (entry.announcement.scenario_sha256()",
     "a client that is not ready may answer"),
    ("sim_server/core/participants/roster.cpp", "if (static_cast<int>(waited_for.size()) < expected) return 0;", "", "the flight goes on without its recorder"),
    # --- the gate
    ("sim_server/core/answers/command_gate.cpp", "if (offered.run_id != run_id_) return Verdict::kOtherRun;", "", "answers to another run are accepted"),
    ("sim_server/core/answers/command_gate.cpp", "if (offered.step != step_) return judge_past(offered, sender);", "", "answers to any step are accepted"),
    ("sim_server/core/answers/command_gate.cpp", "if (!client) return Verdict::kUnknownClient;", "if (!client) {\n    accepted_ = offered;\n    accepted_from_ = sender;\n    return Verdict::kAccepted;\n  }",
     "anybody may answer"),
    ("sim_server/core/answers/command_gate.cpp", "if (offered.is_early && offered.step >= step_) return Verdict::kEarly;", "", "early answers are accepted"),
    ("sim_server/core/answers/command_gate.cpp", "if (a.strength != b.strength) return a.strength > b.strength;", "if (a.strength != b.strength) return a.strength < b.strength;",
     "the weakest client flies"),
    ("sim_server/core/answers/command_gate.cpp", "if (!awaited || !awaited->held) return;", "if (!awaited) return;\n  if (!awaited->held) {\n    for (const Client& client : clients_)\n      if (client.held) awaited = &client;\n    if (!awaited->held) return;\n  }",
     "the first answer wins, of any client"),
    ("sim_server/core/answers/command_gate.cpp", "find_client(awaited->identity.peer)->silent = true;", "", "a silent client is not passed over"),
    ("sim_server/core/answers/command_gate.cpp", "client->is_new = client->silent = false;", "client->is_new = false;", "a client that was silent never flies again"),
    ("sim_server/core/answers/command_gate.cpp", "if (client.is_refused(step_)) continue;", "", "a refused client is awaited"),
    ("sim_server/core/answers/command_gate.cpp", "  accepted_.reset();\n", "", "an answer counts for the next step, too"),
    ("sim_server/core/answers/command_gate.hpp", " && !identity.is_gone; }", "; }", "a dead client is awaited first"),
    ("sim_server/core/answers/command_gate.cpp", "    client.is_new = has_begun_ && !clients_.empty();\n", "",
     "a client that joins is awaited before it answers"),
    ("sim_server/core/answers/command_gate.cpp", "return silent ? silent : gone;", "return gone ? gone : silent;", "of silent clients a dead one is awaited"),
    ("sim_server/core/participants/presence.cpp", "entry.is_gone = seen.silence >= sync::kPresumedDeadAfter;", "entry.is_gone = false;", "no client is ever gone"),
    ("sim_server/core/participants/presence.cpp", "      seen.silence = Clock::duration(0);", "      (void)0;", "a client that is heard stays gone"),
    ("sim_server/core/participants/presence.cpp", "|| answers.answers != seen.answers;", ";", "answers are no sign of life"),
    # --- pacing
    ("sim_server/core/pacing/lockstep_pacing.cpp", "if (now >= resend_at_) resend(now);", "", "states are not sent again"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "return !run_.fleet.vehicles()[i]->gate.accepted().has_value();", "return i == 0;", "only the first vehicle's state is sent again"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "  take_over_if_silent(now);\n", "", "no take-over in lockstep"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "  if (!fleet.are_all_accepted()) return false;\n", "", "a step is taken with the first answer"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "if (!run_.fleet.are_all_accepted()) fly_without_answers(now);", "", "policies do not act in lockstep"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "if (waits) return;", "", "a step is flown without its answer"),
    ("sim_server/core/pacing/lockstep_pacing.cpp", "most->second != Action::kGiveUp;", "true;", "missing controllers are waited for forever"),
    ("sim_server/core/pacing/retransmission_timer.cpp", "return std::min(timeout, kLongest);", "return timeout * 1000;", "states are sent again a thousand times too late"),
    ("sim_server/core/step/vehicle.cpp", "if (calc_absence_s(now) >= rules.calc_controller_patience_s()) return AbsenceAction::kGiveUp;", "", "a server never gives up"),
    ("sim_server/core/step/vehicle.cpp", "absence.policy == ControllerPolicy::kWait || absence", "absence", "the policy wait acts like hold"),
    ("sim_server/core/step/vehicle.cpp", "return held_s < rules.max_hold_s ? AbsenceAction::kHold : AbsenceAction::kFailSafe;", "return AbsenceAction::kHold;", "the fail-safe force never acts"),
    ("sim_server/core/pacing/realtime_pacing.cpp", "if (now < close_at_ || wait_for_last_answers(now)) return false;", "if (wait_for_last_answers(now)) return false;",
     "a real-time step ends at once"),
    ("sim_server/core/pacing/realtime_pacing.cpp", "if (now < close_at_ || wait_for_last_answers(now)) return false;", "if (now < close_at_) return false;",
     "the last answers are not waited for"),
    ("sim_server/core/pacing/realtime_pacing.cpp", "if (is_silent) vehicle->gate.pass_over_silent_client();", "", "no take-over in real time"),
    ("sim_server/core/pacing/realtime_pacing.cpp", "    vehicle.keep_late_answer(answer);", "    (void)vehicle;", "late answers are not held"),
    ("sim_server/core/step/vehicle.cpp", "is_settled_ = true;", "is_settled_ = record_.step % 64 != 63;", "a step is settled twice"),
    ("sim_server/core/report/timing_record.cpp", "++held_;", "", "held steps are not counted"),
    ("sim_server/core/report/timing_record.cpp", "if (kind == model::AnswerKind::kFailSafe) ++fail_safe_;", "", "fail-safe steps are not counted"),
    # --- server core
    ("sim_server/core/server_core.cpp", "  parts_.outputs.record_step(parts_.fleet);\n  for", "  if (parts_.fleet.step() % 97 != 5) parts_.outputs.record_step(parts_.fleet);\n  for",
     "some steps are not recorded"),
    ("sim_server/core/server_core.cpp", "  phase_ = Phase::kAwaitingDue;  // its states", "  // its states", "the phase stays while the plant flies"),
    ("sim_server/core/server_core.cpp", "if (parts_.fleet.is_finished())", "if (parts_.fleet.is_finished() && false)", "a flight never ends"),
    ("sim_server/core/server_core.cpp", "  parts_.outputs.end_records();\n", "", "the last batch is not marked"),
    ("sim_server/core/server_core.cpp", "  preparation_.check_claim(around);\n", "", "claims are not checked in flight"),
    ("sim_server/core/server_core.cpp", "    if (!stop.empty()) throw std::runtime_error(stop);\n", "", "the server ignores SIGINT"),
    ("sim_server/core/server_core.cpp", "if (parts_.control.is_stop_requested()) throw std::runtime_error(parts_.control.last_event());", "", "an operator's stop does nothing"),
    ("sim_server/core/server_core.cpp", "if (phase_ == Phase::kResting || phase_ == Phase::kAwaitingRecorders) parts_.note_rest(rest);", "",
     "a pause counts as absence"),
    ("sim_server/core/server_core.cpp", "request.run_id() != parts_.run_id && around.is_known_elsewhere(request.run_id())", "false", "requests for others are answered"),
    ("sim_server/core/participants/recorder_wait.cpp", "if (wait.patience->is_over(now)) {", "if (false) {", "the policy for recorders never acts"),
    ("sim_server/core/participants/recorder_wait.cpp", "if (policy.policy != config::RecorderPolicy::kGoOn) throw std::runtime_error(waited);", "", "every policy for recorders is go_on"),
    ("sim_server/core/report/absence_report.cpp", "  if (!is_report_due) return;\n", "  return;\n", "a missing controller is not named"),
    ("sim_server/core/participants/participant_watch.cpp", "constexpr auto kRosterTime = 100ms;", "constexpr auto kRosterTime = 100h;", "the silence of participants is not noticed"),
    # --- recorder
    ("recorder/core/stream.cpp", "if (batch.batch_index() == *next_batch_ && !has_ended_) {", "if (!has_ended_) {\n    next_batch_ = batch.batch_index();", "batches are not put in order"),
    ("recorder/core/stream.cpp", "if (next_.step < next_step) {", "if (false) {", "repeated steps are recorded twice"),
    ("recorder/core/stream.cpp", "if (next_.step > next_step) gap_sink_(vehicle->first, next_step, next_.step - 1);", "", "gaps are not listed"),
    ("recorder/core/stream.cpp", "if (next_.step > next_step) gap_sink_(vehicle->first, next_step, next_.step - 1);",
     "if (next_.step > next_step + 1) gap_sink_(vehicle->first, next_step, next_.step - 1);", "gaps of one step are not listed"),
    ("recorder/core/stream.cpp", "has_ended_ = has_ended_ || batch.is_last();", "has_ended_ = has_ended_ || batch.entries().size() < 64;", "a short batch counts as the last"),
    ("recorder/core/stream.cpp", "next = std::min(next, step);", "next = std::max(next, step);", "progress is that of the first vehicle"),
    ("recorder/core/recording_core.cpp", "batch.run_id() != run_id_) return;", "false) return;", "batches of other runs are recorded"),
    ("recorder/core/recording_core.cpp", "if (last_status_ && status.sample_index() <= last_status_->sample_index()) return;", "", "old status samples count"),
    ("recorder/core/recording_core.cpp", "claims.complete = is_finished() && missing.empty() && refused_samples == 0;", "claims.complete = is_finished();", "complete in spite of gaps"),
    ("recorder/core/recording_core.cpp", "claims.complete = is_finished() && missing.empty() && refused_samples == 0;", "claims.complete = missing.empty();", "complete without the end"),
    ("recorder/core/recording_core.cpp", "if (has_run_ended() && stream_.has_ended()) phase_ = Phase::kWhole;", "if (has_run_ended()) phase_ = Phase::kWhole;",
     "the last batches are not waited for"),
    ("recorder/core/recording_core.cpp", "if (has_run_ended() && stream_.has_ended()) phase_ = Phase::kWhole;", "if (stream_.has_ended()) phase_ = Phase::kWhole;",
     "the last status is not waited for"),
    ("recorder/core/recording_core.cpp", "  note_missing_end();\n", "", "a missing end is not listed"),
    ("recorder/core/recording_core.cpp", "if (next < end) note_missing_steps(id, next, end - 1);", "if (next + 1 < end) note_missing_steps(id, next, end - 1);", "one missing step at the end is not listed"),
    ("recorder/core/run_watch.cpp", "if (give_up_->is_over(now.time)) return true;", "", "a recorder waits forever"),
    ("recorder/core/run_watch.cpp", "constexpr double kFailedTime = 1; ", "constexpr double kFailedTime = 0; ", "the rest of a failed run is not waited for"),
    ("recorder/core/run_watch.cpp", "constexpr double kCompletionTime = 10; ", "constexpr double kCompletionTime = 0; ", "the rest of a finished run is not waited for"),
    ("recorder/core/run_watch.cpp", "if (finding != sync::ServerWatch::Finding::kLost) return;", "return;", "a recorder waits forever for a dead server"),
    ("recorder/core/run_watch.cpp", "if (finding == sync::ServerWatch::Finding::kSilent) look_for_next_run(servers, now);", "", "a recorder does not follow"),
    ("recorder/core/run_watch.cpp", "if (!is_due) return false;", "return false;", "a recorder does not announce its progress"),
    ("recorder/core/recorder_core.cpp", "if (options_.unfinished->run_id == to_text(run_id)) return Place::kNextSegment;", "", "--resume does not go on with its run"),
    ("recorder/core/arrivals.cpp", "if (received.sender != server_) return;", "", "batches of any sender are recorded"),
    ("recorder/core/arrivals.cpp", "  for (Received& received : std::exchange(waiting_, {})) put(std::move(received));\n", "", "what came before the recording is lost"),
]


def copy_tree(folder):
    """The sources in a folder of their own, so that no mutant is ever in the working tree."""
    tree = folder / "tree"
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            check=True, capture_output=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        source, copy = ROOT / name, tree / name
        if source.is_file() and not (copy.is_file() and copy.read_bytes() == source.read_bytes()):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)
    return tree


def run(*command, limit_s=LIMIT_S):
    """The exit code, 124 after the limit, and the output."""
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=limit_s, check=False,
                              text=True, errors="replace")
    except subprocess.TimeoutExpired:
        return 124, ""
    return done.returncode, done.stdout


def build(folder, targets):
    code, said = run("ninja", "-C", folder / "build", *targets, limit_s=3600)
    return said if code != 0 else ""


def judge(folder, seeds, with_scripts):
    """What found the mutant: (by the worlds, by the scripts)."""
    by_scripts = "-"
    if with_scripts:
        failed = [name for name in SCRIPTS if run(folder / "build/tests" / name, limit_s=60)[0] != 0]
        by_scripts = ", ".join(failed) or "no"
    code, said = run(folder / "build/bin/sls_worlds", "--seeds", f"0-{seeds - 1}", "--most", "1")
    if code == 0:
        return "no", by_scripts
    found = re.search(r"^seed (\d+):\n  (\S+):", said, re.MULTILINE)
    return (f"{found[2]}, seed {found[1]}" if found else f"exit code {code}"), by_scripts


def put_in(defect, text):
    """`text` of a file with a defect of it."""
    file, old, new, _ = defect
    if text.count(old) != 1:
        sys.exit(f"{file}: expected once: {old!r}, got {text.count(old)} times")
    return text.replace(old, new)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-mutants")
    parser.add_argument("--seeds", type=int, default=20_000)
    parser.add_argument("--only", default="", help="mutants whose line or description holds this text")
    parser.add_argument("--no-scripts", action="store_true")
    parser.add_argument("--check", action="store_true", help="only try whether each mutant fits its file")
    parser.add_argument("--write", type=pathlib.Path, metavar="FILE",
                        help="write the mutated source of the first one chosen into FILE, and end")
    options = parser.parse_args()
    chosen = [mutant for mutant in MUTANTS if options.only in " ".join(mutant)]
    if options.write:
        options.write.write_text(put_in(chosen[0], (ROOT / chosen[0][0]).read_text()))
        return
    if options.check:
        for defect in chosen:
            put_in(defect, (ROOT / defect[0]).read_text())
        return
    folder = options.build.resolve()
    folder.mkdir(exist_ok=True)
    tree = copy_tree(folder)
    targets = ["sls_worlds"] + ([] if options.no_scripts else list(SCRIPTS))
    subprocess.run(["cmake", "-S", tree, "-B", folder / "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                    "-DCMAKE_CXX_FLAGS_RELEASE=-O1", "-DSLS_BUILD_PROGRAMS=OFF"], check=True, stdout=subprocess.DEVNULL,
                   env=os.environ)
    if said := build(folder, targets):
        sys.exit(said[-3000:])
    found = 0
    print("| defect | found by worlds | by scripts |\n| --- | --- | --- |", flush=True)
    for defect in chosen:
        file, what = defect[0], defect[3]
        path = tree / file
        text = path.read_text()
        path.write_text(put_in(defect, text))
        began = time.monotonic()
        said = build(folder, targets)
        worlds, scripts = ("does not compile", "") if said else judge(folder, options.seeds, not options.no_scripts)
        path.write_text(text)
        found += worlds != "no" and not said
        print(f"| {file}: {what} | {worlds} | {scripts} |", flush=True)
        print(f"{time.monotonic() - began:.0f} s {said[-400:]}", file=sys.stderr, flush=True)
    print(f"\n{found} of {len(chosen)} are found by the worlds")


if __name__ == "__main__":
    main()
