#!/usr/bin/env bash
# The launcher: sets up what it needs, builds, flies, tests. `./sls help` lists the subcommands.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
readonly root
readonly build="${SLS_BUILD:-$root/build}"
readonly flying=(sim_server control_client recorder)
readonly programs=("${flying[@]}" sim_ctl sls_verify delay_margin)
readonly packages=(g++ make cmake libeigen3-dev libsimbody-dev libfastrtps-dev libfastcdr-dev
  fastddsgen default-jre-headless libyaml-cpp-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libgtest-dev libssl-dev
  libtinyxml2-dev)
readonly test_packages=(iproute2 nftables)

say() { echo "sls: $*" >&2; }
fail() { say "error: $1"; exit "${2:-1}"; }

usage() {
  cat <<'EOF'
usage: ./sls COMMAND [OPTIONS]

  demo [SCENARIO]    set up, build, fly (default: figure_eight), print the summary
  run SCENARIO       server, client and recorder on this machine; ends 0 when the mission finished
                     and the recording is complete. SCENARIO is a name in config/scenarios or a path
      --out DIR        folder of the recording (default: recordings/NAME-UTCTIME)
      --force          replace the recording that is there
      --qos FILE       QoS profiles (default: config/qos/default.xml)
      --domain N       DDS domain, 0 to 232 (default: 0)
      --period-s X     control period in force (default: the scenario's)
      --mode MODE      lockstep or realtime (default: the scenario's)
      --rtf X          of realtime: simulated over wall time (default: the scenario's)
  ctl COMMAND        talk to the run on this domain: pause, step N, resume, start, reset, stop or
                     status [--watch] [--json]; with --help: its options
  delay-margin SCENARIO
                     the delay of the command at which the controller loses the load, with a table
      --period-s X     control period in force (default: the scenario's)
  verify A [B]       compares the data of two recordings: equal, or the first difference; of one, its
                     files with its manifest
  test               set up, build, run every test
      --slow           the ones that take minutes, too; they need an idle machine
      --sanitize KIND  the unit tests alone, built with a sanitizer: address or thread
  chaos              disturb flights at random: stop, continue, kill and restart their processes
      --trials N       how many flights (default: 10)
      --seed S         decides process, moment and kind (default: 1)
      --verbose        print what the processes said
  build              set up and build; the programs are in build/bin
  clean              remove what was built
  help               this text

exit codes: 0 done; 1 the run or a test failed; 2 bad usage or bad configuration; 130/143 interrupted
EOF
}

# --- set-up and build -----------------------------------------------------------------------------

# setup [PACKAGE…]: what building and flying need, and the packages named.
setup() {
  local missing=() package
  for package in "${packages[@]}" "$@"; do
    [[ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" == installed ]] ||
      missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  say "installing with apt-get: ${missing[*]}"
  local sudo=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "set-up needs root: apt-get install ${missing[*]}"
    sudo=(sudo)
  fi
  local log
  log="$(mktemp)"
  if ! { "${sudo[@]}" apt-get update &&
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
      "${missing[@]}"; } >"$log" 2>&1; then
    tail -n 15 "$log" >&2
    fail "apt-get failed (whole log: $log)"
  fi
  rm -f "$log"
}

# build_tree PRESET FOLDER [TARGET…]: configures where needed and builds; all targets by default.
build_tree() {
  local preset=$1 folder=$2 targets=()
  shift 2
  (($#)) && targets=(--target "$@")
  local cache="$folder/CMakeCache.txt" fresh=()
  if [[ -f $cache ]] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$cache"; then
    fresh=(--fresh)  # the tree was copied or moved
  fi
  mkdir -p "$folder"
  [[ -f $cache ]] || say "building for the first time, which takes minutes (log: $folder/build.log)"
  if ! { (cd "$root" && cmake --preset "$preset" "${fresh[@]}") &&
    cmake --build "$folder" --parallel "$(nproc)" "${targets[@]}"; } >"$folder/build.log" 2>&1; then
    grep -E -m 20 'error|Error' "$folder/build.log" >&2 || tail -n 20 "$folder/build.log" >&2
    fail "the build failed (whole log: $folder/build.log)"
  fi
}

# build_programs [TARGET…]: what is named, or all programs, up to date. A build made elsewhere
# (SLS_BUILD) is taken as it is.
build_programs() {
  [[ -z ${SLS_BUILD:-} ]] || return 0
  (($#)) || set -- "${programs[@]}"
  setup
  build_tree release "$build" "$@"
}

# --- flying ---------------------------------------------------------------------------------------

# Processes this launcher started: name by process id.
declare -A name_of=()

# The kernel ends the process should this launcher be killed.
start() {
  local name=$1
  shift
  setpriv --pdeathsig TERM -- "$build/bin/$name" "$@" &
  name_of[$!]=$name
}

signal_all() {
  ((${#name_of[@]})) || return 0
  kill "-$1" "${!name_of[@]}" 2>/dev/null || true
}

interrupted=0
on_signal() {
  interrupted=$1
  signal_all "$2"
}

# Waits for all processes; the exit code of the run is in `result`. When one ends badly, the others
# cannot finish the run: they are asked to end, in order, and close their files.
wait_all() {
  result=0
  local finished code
  while ((${#name_of[@]})); do
    finished='' code=0
    wait -n -p finished "${!name_of[@]}" || code=$?
    [[ -n ${finished:-} ]] || continue  # a signal came; on_signal has passed it on
    local name=${name_of[$finished]}
    unset "name_of[$finished]"
    ((code == 0 || result != 0)) && continue
    result=$((code == 2 ? 2 : 1))
    ((${#name_of[@]} && ! interrupted)) && say "$name ended with $code: ending the others"
    signal_all TERM
  done
  ((interrupted == 0)) || result=$interrupted
}

find_scenario() {
  if [[ -f $1 || $1 == */* || $1 == *.yaml ]]; then
    echo "$1"
  else
    echo "$root/config/scenarios/$1.yaml"
  fi
}

# fly SCENARIO [OPTIONS]: sets `recording` and `result`.
fly() {
  local scenario='' force=() qos=() domain=() timing=()
  recording=''
  while (($#)); do
    case $1 in
      --force) force=(--force) ;;
      --out | --qos | --domain | --period-s | --mode | --rtf)
        (($# >= 2)) || fail "$1: expected a value (see ./sls help)" 2
        case $1 in
          --out) recording=$2 ;;
          --qos) qos=(--qos "$2") ;;
          --domain) domain=(--domain "$2") ;;
          *) timing+=("$1" "$2") ;;
        esac
        shift
        ;;
      -*) fail "unknown option '$1' (see ./sls help)" 2 ;;
      *)
        [[ -z $scenario ]] || fail "expected one scenario, got '$scenario' and '$1'" 2
        scenario=$1
        ;;
    esac
    shift
  done
  [[ -n $scenario ]] || fail "expected a scenario (see ./sls help)" 2
  local file
  file="$(find_scenario "$scenario")"
  if [[ -z $recording ]]; then
    recording="recordings/$(basename "$file" .yaml)-$(date -u +%Y%m%dT%H%M%SZ)"
  fi

  # One line about a mistake, before three programs stumble over it.
  "$build/bin/sim_server" --check --scenario "$file" "${qos[@]}" "${domain[@]}" "${timing[@]}" ||
    exit $?
  "$build/bin/recorder" --check --out "$recording" "${force[@]}" "${qos[@]}" "${domain[@]}" ||
    exit $?

  trap 'on_signal 130 INT' INT
  trap 'on_signal 143 TERM' TERM HUP
  trap 'signal_all TERM' EXIT
  start recorder --out "$recording" "${force[@]}" "${qos[@]}" "${domain[@]}"
  start sim_server --scenario "$file" "${qos[@]}" "${domain[@]}" "${timing[@]}"
  start control_client --scenario "$file" "${qos[@]}" "${domain[@]}"
  wait_all
}

# --- the summary of a flight ----------------------------------------------------------------------

# Published figures of the same figure eight, second lap (sources: README.md).
print_comparison() {
  local lap
  lap="$(awk '$1 == "lap" && $2 == "2" { print $3, $4, $5, $6, $7 }' "$recording/flight.txt")"
  [[ -n $lap ]] || return 0
  local rms_x rms_y rms_z max_x max_y
  read -r rms_x rms_y rms_z max_x max_y <<<"$lap"
  local row='  %-34s %9s %9s %9s  %9s %9s\n'
  echo "Load position error on the second lap, beside the published figures (m)"
  printf "$row" '' 'rms x' 'rms y' 'rms z' 'max x' 'max y'
  printf "$row" 'this flight' "$rms_x" "$rms_y" "$rms_z" "$max_x" "$max_y"
  printf "$row" 'MATLAB ODE (continuous control)' 1.7e-06 4.3e-06 3e-07 6e-06 2.6e-05
  printf "$row" 'pure Gazebo (state-wiring error)' 0.211 0.236 0.004 0.388 0.413
  printf "$row" 'PX4 software in the loop' 0.131 0.234 0.097 0.214 0.346
  echo
}

print_summary() {
  echo
  cat "$recording/flight.txt"
  echo
  [[ $(awk 'NR == 1 { print $1 }' "$recording/flight.txt") == figure_eight: ]] && print_comparison
  echo "Files in $recording"
  (cd "$recording" && wc -c -- * | awk '$2 != "total" { printf "  %-16s %10d bytes\n", $2, $1 }')
}

# --- subcommands ----------------------------------------------------------------------------------

cmd_build() {
  build_programs
  say "programs in build/bin: ${programs[*]}"
}

cmd_run() {
  build_programs "${flying[@]}"
  fly "$@"
  ((result == 0)) && say "recording: $recording"
  exit "$result"
}

cmd_demo() {
  build_programs "${flying[@]}"
  local scenario=figure_eight
  if (($#)) && [[ $1 != -* ]]; then
    scenario=$1
    shift
  fi
  say "flying $scenario"
  fly "$scenario" "$@"
  ((result == 0)) || exit "$result"
  print_summary
}

cmd_ctl() {
  build_programs sim_ctl
  exec "$build/bin/sim_ctl" "$@"
}

cmd_delay-margin() {
  local scenario='' period=()
  while (($#)); do
    case $1 in
      --period-s)
        (($# >= 2)) || fail "$1: expected a value (see ./sls help)" 2
        period=(--period-s "$2")
        shift
        ;;
      -*) fail "unknown option '$1' (see ./sls help)" 2 ;;
      *)
        [[ -z $scenario ]] || fail "expected one scenario, got '$scenario' and '$1'" 2
        scenario=$1
        ;;
    esac
    shift
  done
  [[ -n $scenario ]] || fail "expected a scenario (see ./sls help)" 2
  build_programs delay_margin
  exec "$build/bin/delay_margin" --scenario "$(find_scenario "$scenario")" "${period[@]}"
}

cmd_verify() {
  build_programs sls_verify
  exec "$build/bin/sls_verify" "$@"
}

cmd_chaos() {
  build_programs chaos
  exec "$build/tests/chaos" "$@"
}

cmd_test() {
  local preset=release folder=$build without=(--label-exclude slow)
  if [[ $# == 1 && $1 == --slow ]]; then
    without=()
  elif (($#)); then
    [[ $# == 2 && $1 == --sanitize && ($2 == address || $2 == thread) ]] ||
      fail "test: expected nothing, --slow or --sanitize address|thread, got '$*'" 2
    [[ $2 == address ]] && preset=asan || preset=tsan
    folder="$root/build-$preset"
  fi
  setup "${test_packages[@]}"
  build_tree "$preset" "$folder"
  cd "$root"
  # Nothing the middleware reads from the environment may reach the tests.
  env -u ROS_DISCOVERY_SERVER -u FASTRTPS_DEFAULT_PROFILES_FILE \
    ctest --preset "$preset" --parallel "$(nproc)" "${without[@]}"
}

command=${1:-help}
(($#)) && shift
case $command in
  demo | run | ctl | verify | delay-margin | chaos | test | build) "cmd_$command" "$@" ;;
  clean) rm -rf "$root"/build "$root"/build-* ;;
  help | --help | -h) usage ;;
  *)
    say "error: unknown command '$command'"
    usage >&2
    exit 2
    ;;
esac
