#!/usr/bin/env bash
# The launcher: sets up what it needs, builds, flies, tests. `./sls help` lists the commands.
set -euo pipefail

root="$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)"
readonly root
# If installed, this file is PREFIX/share/sls/sls, `bin` beside it is a link to the programs, and nothing is built.
if [[ $root == */share/sls && ! -f $root/CMakeLists.txt ]]; then
  readonly is_installed=1 self=sls build="${SLS_BUILD:-$root}"
  readonly python_path="$root/python:$build/python:${root%/share/sls}/lib/python3/dist-packages"
else
  readonly is_installed=0 self=./sls build="${SLS_BUILD:-$root/build}"
  readonly python_path="$root/python:$build/python"
fi
readonly source_commands=(bench build chaos clean docker-demo docs fuzz network-table package reference setup study systems test)
readonly flying=(sim_server control_client recorder closed_loop)
readonly programs=("${flying[@]}" sim_ctl sls_verify sls_convert delay_margin sls_doctor sls_view)
readonly packages=(g++ make ninja-build cmake libeigen3-dev libsimbody-dev libfastcdr-dev
  fastddsgen default-jre-headless libyaml-cpp-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libgtest-dev libssl-dev
  libtinyxml2-dev openssl pybind11-dev python3-dev python3-numpy libboost-dev libzstd-dev zlib1g-dev)
readonly fuzz_packages=(clang libclang-rt-dev)
readonly fuzzers=(scenario qos_file csv recording samples foxglove web)
readonly test_packages=(libgmock-dev libmpfr-dev python3-mpmath iproute2 nftables cyclonedds-dev cyclonedds-tools fastdds-tools libfaketime
  python3-pytest python3-venv slurm-wlm munge python3-distributed chromium mandoc debootstrap git codespell)
readonly python_packages=(python3-numpy python3-scipy python3-matplotlib python3-yaml)
readonly bench_packages=(libbenchmark-dev python3-matplotlib chromium)
readonly doc_packages=(doxygen python3-sphinx)
readonly package_packages=(dpkg-dev file python3-yaml)
# Packages that only one system has. The launcher installs packages on these systems alone.
readonly systems=(debian12 debian13)
readonly debian12_packages=(libfastrtps-dev)
readonly debian13_packages=(libfastdds-dev)

say() { local text="$*"; echo "sls: ${text//see .\/sls/see $self}" >&2; }
fail() { say "error: $1"; exit "${2:-1}"; }

usage() {
  cat <<'EOF'
usage: ./sls COMMAND [OPTIONS]
       ./sls COMMAND --help     options of a command

Fly
  demo [SCENARIO]         set up, build, fly (default: figure_eight) and print a summary
  run SCENARIO            fly a scenario on this machine and record it
  view [DIR [DIR]]        show a live flight, a recording or two recordings in the browser
  ctl COMMAND             pause, step, resume, start, reset or stop a run, or print its status
  docker-demo [NAME]      fly in containers

Recordings
  verify A [B]            compare two recordings, or one recording with its manifest
  convert DIR             write a recording as one MCAP file
  plot DIR…               draw figures of recordings and of published logs
  report DIR              write DIR/report.html: parameters, metrics, figures, events
  python [ARGS]           run Python with the package `sls`

Many flights
  campaign FILE           fly many runs of one scenario with varied keys; also: status, report, compare
  campaign-worker DIR     fly chunks of a campaign (started by Slurm)
  study                   repeat the published comparison and write docs/study.md
  delay-margin SCENARIO   find the command delay at which the controller loses the load

Network
  doctor                  find out why data does not flow
  keys DIR                make keys and signed permissions for config/qos/secure.xml
  discovery-server        run a discovery server for config/qos/discovery_server.xml
  network-table           fly each QoS profile through network disturbances; print a Markdown table

Development
  test                    set up, build and run the tests
  bench                   measure speed, each figure beside its bound
  chaos                   stop, continue, kill and restart processes of flights at random
  fuzz                    feed mutated input to every reader of files and samples
  reference               write docs/reference and the bash completion from the code's tables
  docs                    build API pages of headers and Python package: build/docs/index.html
  package                 build a Debian package: build/package/
  systems [NAME…]         run the two commands in clean Debian systems and print a table
  setup | build | clean   install packages | build all programs | remove what was built
  help [COMMAND]          this text, or the options of a command

environment: SLS_DOMAIN is the DDS domain of every program that is not given --domain
--no-install with any command: install no Debian packages, use what is there
exit codes: 0 done; 1 the run or a test failed; 2 bad usage or bad configuration; 130/143 interrupted
EOF
}

flight_usage() {
  cat <<'EOF'

SCENARIO is a name in config/scenarios or a path.

  --out DIR        folder of the recording (default: recordings/NAME-UTCTIME)
  --force          replace an existing recording
  --qos FILE       QoS profiles (default: config/qos/default.xml)
  --domain N       DDS domain, 0 to 232 (default: 0)
  --period-s X     control period (default: the scenario's)
  --mode MODE      lockstep or realtime (default: the scenario's)
  --rtf X          real-time factor, realtime mode only (default: the scenario's)
  --in-process     fly in one process without DDS: same data, same certificate
  --view           also show the flight in the browser; prints the address of the page
  --view-port N    like --view, on port N; 0: any free port (default: 8765)
EOF
}

# True if --help or -h is among the arguments of the command.
is_help_asked() { [[ " ${arguments[*]} " == *' --help '* || " ${arguments[*]} " == *' -h '* ]]; }

# command_usage COMMAND: prints the help of a command that this launcher implements; false for other commands.
command_usage() {
  case $1 in
    demo)
      echo 'usage: ./sls demo [SCENARIO] [OPTIONS]'
      echo
      echo 'Sets up, builds, flies a scenario (default: figure_eight) and prints a summary.'
      flight_usage
      ;;
    run)
      echo 'usage: ./sls run SCENARIO [OPTIONS]'
      echo
      echo 'Runs server, client and recorder on this machine. Exit code 0: the mission finished and the'
      echo 'recording is complete.'
      flight_usage
      ;;
    delay-margin)
      cat <<'EOF'
usage: ./sls delay-margin SCENARIO [--period-s X]

Finds the command delay at which the controller loses the load; prints a table.

  --period-s X     control period (default: the scenario's)
EOF
      ;;
    discovery-server)
      cat <<'EOF'
usage: ./sls discovery-server [--listen ADDRESS] [--port N]

Runs a discovery server for config/qos/discovery_server.xml until it is stopped.

  --listen ADDRESS  address to listen on (default: every address of this machine)
  --port N          UDP port (default: 11811)
EOF
      ;;
    test)
      cat <<'EOF'
usage: ./sls test [--slow | --sanitize KIND] [--only REGEX]

Sets up, builds and runs the tests. build/test.xml has the output of each.

  --slow            also run the tests that take minutes; they need an idle machine
  --sanitize KIND   run only the unit tests, built with a sanitizer: address; or thread, which runs those
                    with several threads
  --only REGEX      run only the tests whose names match
EOF
      ;;
    fuzz)
      cat <<'EOF'
usage: ./sls fuzz [--seconds N] [--target NAME]

Feeds mutated input to every reader of files and samples until one crashes.

  --seconds N      duration of all targets together (default: 60)
  --target NAME    run only this target: scenario, qos_file, csv, recording, samples, foxglove or web
EOF
      ;;
    setup) printf '%s\n\n%s\n' 'usage: ./sls setup' 'Installs the packages that building and flying need.' ;;
    build) printf '%s\n\n%s\n' 'usage: ./sls build' 'Sets up and builds; the programs are in build/bin.' ;;
    clean) printf '%s\n\n%s\n' 'usage: ./sls clean' 'Removes the folders build and build-*.' ;;
    docs)
      printf '%s\n\n%s\n%s\n' 'usage: ./sls docs' \
        'Builds API pages of the C++ and C headers and of the Python package:' 'build/docs/index.html.'
      ;;
    package)
      cat <<'EOF'
usage: ./sls package [--system NAME]

Builds a Debian package of all that a user needs: build/package/sls_VERSION_ARCHITECTURE.deb. The version ends with the
name of the system, such as debian12.

  --system NAME    build it in a clean tree of another system, debian12 or debian13, as ./sls systems does
EOF
      ;;
    python)
      cat <<'EOF'
usage: ./sls python [ARGS]

Runs Debian's Python with the package `sls`. ARGS: a script, -m MODULE, -c COMMAND, or none for a prompt.
EOF
      ;;
    *) return 1 ;;
  esac
}

# --- set-up and build -----------------------------------------------------------------------------

# Puts the name of this system into `system`: one of `systems`. Fails on another.
expect_system() {
  local name
  IFS=/ read -r system name < <(
    unset ID VERSION_ID PRETTY_NAME
    [[ ! -r /etc/os-release ]] || . /etc/os-release
    echo "${ID:-}${VERSION_ID:-}/${PRETTY_NAME:-unknown (no /etc/os-release)}"
  )
  [[ " ${systems[*]} " == *" $system "* ]] ||
    fail "this system is $name; tried are Debian 12 and 13. Elsewhere install by hand what the lists at the top of $root/sls name, then add --no-install"
}

# setup [PACKAGE…]: installs the packages for building and flying, and the given ones.
setup() {
  if ((is_installed)); then
    install_missing "$@"
    return
  fi
  if ((is_installing)); then
    expect_system
    local -n own="${system}_packages"
    install_missing "${packages[@]}" "${own[@]}" "$@"
  fi
  install_node
  install_node_modules "$root/tools/view/page"
}

# Node and npm bundle the page. Installs Debian's unless others are installed.
install_node() {
  local missing=()
  command -v node >/dev/null || missing+=(nodejs)
  command -v npm >/dev/null || missing+=(npm)
  ((${#missing[@]} == 0)) || install_missing "${missing[@]}"
  local version
  version="$(node --version)" || fail "node --version failed"
  if ! [[ $version =~ ^v([0-9]+)\. ]] || ((BASH_REMATCH[1] < 18)); then
    fail "node: expected version 18 or later, got $version"
  fi
}

# install_node_modules FOLDER: installs the packages of FOLDER's lock file if this file has changed. Does nothing if
# FOLDER is missing, as in docker/Dockerfile, which copies the launcher first.
install_node_modules() {
  local lock="$1/package-lock.json" installed="$1/node_modules/.package-lock.json" log
  [[ -f $lock ]] || return 0
  [[ -f $installed && ! $lock -nt $installed ]] && return
  say "installing with npm: what $lock names"
  log="$(mktemp)"
  if ! npm ci --prefix "$1" --no-audit --no-fund >"$log" 2>&1; then
    fail "npm ci: $(sed -nE 's/^npm (ERR!|error) //p' "$log" | head -n 4 | paste -sd ' ') (whole log: $log)"
  fi
  rm -f "$log"
  touch "$installed"  # npm leaves it older than the lock file where nothing had to change
}

# find_line START FILE [TEXT]: prints TEXT and the rest of the first line that begins with START.
find_line() {
  local line
  line="$(sed -nE "s/$1//p" "$2" | head -n 1)"
  [[ -z $line ]] || echo -n "${3:-}$line"
}

install_missing() {
  ((is_installing)) || return 0
  local missing=() package installed
  installed=" $(dpkg-query -W -f='${Package}=${db:Status-Status} ' "$@" 2>/dev/null || true)"
  for package in "$@"; do
    [[ $installed == *" $package=installed "* ]] || missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  ((is_installed == 0)) || fail "this needs packages that are not installed: apt-get install ${missing[*]}"
  expect_system
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
    # apt-get update only warns where the network is missing; then packages are unknown.
    fail "apt-get: $(find_line '^E: ' "$log")$(find_line '^W: Failed to fetch ' "$log" '; ') (whole log: $log)"
  fi
  rm -f "$log"
}

# has_tree FOLDER: true if it is a build tree of this checkout made with Ninja, false if none, copied or moved.
has_tree() {
  [[ -f $1/build.ninja && -f $1/CMakeCache.txt ]] &&
    [[ $(grep -cxF -e "CMAKE_HOME_DIRECTORY:INTERNAL=$root" -e CMAKE_GENERATOR:INTERNAL=Ninja "$1/CMakeCache.txt") == 2 ]]
}

# is_built FOLDER TARGET…: true if building would do nothing. Ninja compares every file that the build has read, system
# headers and CMake's files among them, in a twentieth of the time that CMake takes.
is_built() {
  has_tree "$1" && [[ $(ninja -C "$1" -n "${@:2}" 2>/dev/null) == *'ninja: no work to do.' ]]
}

# build_tree PRESET FOLDER [TARGET…]: configures and builds; all targets by default.
build_tree() {
  local preset=$1 folder=$2 targets=()
  shift 2
  (($#)) && targets=(--target "$@")
  local fresh=() lock
  mkdir -p "$folder"
  exec {lock}>"$folder/lock"
  flock "$lock"  # Ninja's files do not survive two builds of one folder at once
  if ! has_tree "$folder"; then
    fresh=(--fresh)
    rm -f "$folder/Makefile"  # of earlier versions, which built with make
    say "building for the first time, which takes minutes (log: $folder/build.log)"
  fi
  if ! { (cd "$root" && cmake --preset "$preset" "${fresh[@]}") &&
    cmake --build "$folder" --parallel "$(nproc)" "${targets[@]}"; } >"$folder/build.log" 2>&1; then
    local reason
    reason="$(awk '/^CMake Error/ { found = 1; next } found && NF { sub(/^ +/, ""); text = text " " $0 }
      found && !NF && text { print text; exit }' "$folder/build.log")"
    [[ -z $reason ]] || fail "CMake:$reason (whole log: $folder/build.log)"
    grep -E -m 20 'error:|Error |ERROR|undefined reference' "$folder/build.log" >&2 || tail -n 20 "$folder/build.log" >&2
    fail "the build failed (whole log: $folder/build.log)"
  fi
  exec {lock}>&-
}

# build_programs [TARGET…]: brings the targets, or all programs, up to date. A build made elsewhere
# (SLS_BUILD) is used unchanged.
build_programs() {
  [[ -z ${SLS_BUILD:-} && $is_installed == 0 ]] || return 0
  if is_help_asked && [[ -x $build/bin/${1:-} || -x $build/tests/${1:-} ]]; then
    return  # as it is
  fi
  (($#)) || set -- "${programs[@]}" _sls_core
  ! is_built "$build" "$@" || return 0
  setup
  build_tree release "$build" "$@"
}

# --- flying ---------------------------------------------------------------------------------------

# Processes this launcher started: name by process id.
declare -A name_of=()

# start PROGRAM [ARGUMENTS…]. If this launcher is killed, the kernel ends the program.
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

# The viewer is not part of the flight: the launcher ignores its end and its exit code.
viewer=''
start_viewer() {
  setpriv --pdeathsig TERM -- "$build/bin/sls_view" "$@" &
  viewer=$!
}

end_viewer() {
  [[ -n $viewer ]] || return 0
  kill -TERM "$viewer" 2>/dev/null || true
  wait "$viewer" 2>/dev/null || true
  viewer=''
}

interrupted=0
on_signal() {
  interrupted=$1
  signal_all "$2"
}

# Waits for all processes and puts the exit code of the run into `result`. When one fails, the others
# cannot finish the run: they get SIGTERM, close their files and end.
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
  local scenario='' force=() qos=() domain=() timing=() view=() is_in_process=0
  recording=''
  while (($#)); do
    case $1 in
      --force) force=(--force) ;;
      --in-process) is_in_process=1 ;;
      --view) ((${#view[@]})) || view=(--port 8765) ;;
      --view-port | --out | --qos | --domain | --period-s | --mode | --rtf)
        (($# >= 2)) || fail "$1: expected a value (see ./sls $command --help)" 2
        case $1 in
          --view-port) view=(--port "$2") ;;
          --out) recording=$2 ;;
          --qos) qos=(--qos "$2") ;;
          --domain) domain=(--domain "$2") ;;
          *) timing+=("$1" "$2") ;;
        esac
        shift
        ;;
      -*) fail "unknown option '$1' (see ./sls $command --help)" 2 ;;
      *)
        [[ -z $scenario ]] || fail "expected one scenario, got '$scenario' and '$1'" 2
        scenario=$1
        ;;
    esac
    shift
  done
  [[ -n $scenario ]] || fail "expected a scenario (see ./sls $command --help)" 2
  local file
  file="$(find_scenario "$scenario")"
  if [[ -z $recording ]]; then
    recording="recordings/$(basename "$file" .yaml)-$(date -u +%Y%m%dT%H%M%SZ)"
  fi

  trap 'on_signal 130 INT' INT
  trap 'on_signal 143 TERM' TERM HUP
  trap 'signal_all TERM; end_viewer' EXIT
  if ((is_in_process)); then
    [[ -z "${qos[*]}${domain[*]}${view[*]}" && " ${timing[*]} " != *' --mode '* && " ${timing[*]} " != *' --rtf '* ]] ||
      fail "--in-process: expected no --qos, --domain, --mode, --rtf or --view with it: one process has no network and no clock" 2
    start closed_loop --scenario "$file" --out "$recording" "${force[@]}" "${timing[@]}"
    wait_all
    return
  fi

  # Checks first, so that a mistake gives one error line and not one from each program.
  "$build/bin/sim_server" --check --scenario "$file" "${qos[@]}" "${domain[@]}" "${timing[@]}" >/dev/null ||
    exit $?
  "$build/bin/recorder" --check --out "$recording" "${force[@]}" "${qos[@]}" "${domain[@]}" ||
    exit $?

  ((${#view[@]} == 0)) || start_viewer "${view[@]}" "${qos[@]}" "${domain[@]}"
  start recorder --out "$recording" "${force[@]}" "${qos[@]}" "${domain[@]}"
  start sim_server --scenario "$file" "${qos[@]}" "${domain[@]}" "${timing[@]}"
  start control_client --scenario "$file" "${qos[@]}" "${domain[@]}"
  wait_all
  end_viewer
}

# --- the summary of a flight ----------------------------------------------------------------------

# Prints the errors of the second lap beside the published figures of the same figure eight.
print_comparison() {
  local lap cells row='  %-34s %9s %9s %9s  %9s %9s\n'
  read -ra lap < <(awk '$1 == "lap" && $2 == "2" && $3 != "(part)" { print $3, $4, $5, $6, $7 }' \
    "$recording/flight.txt") || return 0
  echo "Load position error on the second lap, beside the published figures (m)"
  {
    IFS=, read -ra cells
    printf "$row" '' "${cells[@]:1}"
    printf "$row" 'this flight' "${lap[@]}"
    while IFS=, read -ra cells; do printf "$row" "${cells[@]}"; done
  } <"$root/python/sls/published_lap_2.csv"
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

cmd_setup() { setup; }

cmd_build() {
  build_programs
  say "programs in build/bin: ${programs[*]}; the module of the package sls in build/python"
}

# build_for_flight [OPTIONS of the flight]
build_for_flight() {
  if [[ " $* " == *" --view"* ]]; then
    build_programs "${flying[@]}" sls_view
  else
    build_programs "${flying[@]}"
  fi
}

cmd_run() {
  build_for_flight "$@"
  fly "$@"
  ((result == 0)) && say "recording: $recording"
  exit "$result"
}

cmd_demo() {
  build_for_flight "$@"
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

cmd_view() {
  build_programs sls_view
  exec "$build/bin/sls_view" "$@"
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
        (($# >= 2)) || fail "$1: expected a value (see ./sls $command --help)" 2
        period=(--period-s "$2")
        shift
        ;;
      -*) fail "unknown option '$1' (see ./sls $command --help)" 2 ;;
      *)
        [[ -z $scenario ]] || fail "expected one scenario, got '$scenario' and '$1'" 2
        scenario=$1
        ;;
    esac
    shift
  done
  [[ -n $scenario ]] || fail "expected a scenario (see ./sls $command --help)" 2
  build_programs delay_margin
  exec "$build/bin/delay_margin" --scenario "$(find_scenario "$scenario")" "${period[@]}"
}

cmd_bench() {
  if ! is_help_asked; then
    if [[ -z ${SLS_BUILD:-} ]]; then
      setup "${bench_packages[@]}"
      install_node_modules "$root/tests/tools/view"
    fi
    build_programs "${flying[@]}" sim_ctl sls_view sls_bench_probe sls_bench_spinning_probe sls_microbench view_foxglove_publisher
  fi
  PYTHONPATH="$root" exec /usr/bin/python3 -BP -m bench --build "$build" "$@"
}

cmd_verify() {
  build_programs sls_verify
  exec "$build/bin/sls_verify" "$@"
}

cmd_convert() {
  build_programs sls_convert
  exec "$build/bin/sls_convert" "$@"
}

# run_python COMMAND…. -P: Python imports nothing from the working folder; -B: it writes no compiled files.
run_python() {
  install_missing "${python_packages[@]}"
  PYTHONPATH="$python_path" exec /usr/bin/python3 -BP -m sls "$@"
}

cmd_python() {
  install_missing "${python_packages[@]}"
  build_programs _sls_core
  PYTHONPATH="$python_path${PYTHONPATH:+:$PYTHONPATH}" exec /usr/bin/python3 -B "$@"
}

cmd_plot() { run_python plot "$@"; }

cmd_report() {
  if ! is_help_asked; then
    build_programs sls_view
    export SLS_VIEW="$build/bin/sls_view"  # draws the report's scene
  fi
  run_python report "$@"
}

cmd_study() {
  if ! is_help_asked && [[ " $* " != *" --reuse "* ]]; then
    build_programs "${flying[@]}" delay_margin
    export SLS_BUILD="$build"  # the flights of the study fly side by side and must not build
  fi
  run_python study "$@"
}

# run_campaign MODULE [ARGS…]: with the compiled module on the path.
run_campaign() {
  install_missing "${python_packages[@]}"
  export SLS_BUILD="$build"  # flights over DDS must not build
  PYTHONPATH="$python_path" exec /usr/bin/python3 -BP -m "$@"
}

cmd_campaign() {
  if ! is_help_asked && [[ " status report compare " != *" ${1:-} "* ]]; then
    local targets=(_sls_core)
    [[ " $* " != *" --verify"* ]] || targets+=("${flying[@]}" sls_verify)
    build_programs "${targets[@]}"
  fi
  run_campaign sls.campaign "$@"
}

cmd_campaign-worker() {
  is_help_asked || build_programs _sls_core
  run_campaign sls.campaign.worker "$@"
}

cmd_doctor() {
  build_programs sls_doctor
  exec "$build/bin/sls_doctor" "$@"
}

cmd_keys() {
  command -v openssl >/dev/null || setup
  exec "$root/config/security/keys.sh" "$@"
}

cmd_docker-demo() {
  source "$root/docker/demo.sh"
  docker_demo "$@"
}

cmd_discovery-server() {
  local listen=() port=11811
  while (($#)); do
    (($# >= 2)) || fail "$1: expected a value (see ./sls $command --help)" 2
    case $1 in
      --listen) listen=(-l "$2") ;;
      --port) port=$2 ;;
      *) fail "unknown option '$1' (see ./sls $command --help)" 2 ;;
    esac
    shift 2
  done
  [[ $port =~ ^[1-9][0-9]{0,4}$ ]] && ((port <= 65535)) || fail "--port: expected 1 to 65535, got '$port'" 2
  command -v fast-discovery-server >/dev/null || setup fastdds-tools
  say "discovery server on port $port; clients: SLS_DISCOVERY_SERVER=${listen[1]:-this machine}"
  # Number 0 has the identity that discovery_server.xml expects.
  exec fast-discovery-server -i 0 "${listen[@]}" -p "$port"
}

cmd_network-table() {
  [[ -n ${SLS_BUILD:-} ]] || is_help_asked || setup "${test_packages[@]}"
  build_programs network_table
  exec "$build/tests/network_table" "$@"
}

cmd_fuzz() {
  local seconds=60 targets=("${fuzzers[@]}") target
  while (($#)); do
    (($# >= 2)) || fail "fuzz: $1: expected a value (see ./sls $command --help)" 2
    case $1 in
      --seconds)
        [[ $2 =~ ^[1-9][0-9]{0,5}$ ]] || fail "fuzz: --seconds: expected a whole number, got '$2'" 2
        seconds=$2
        ;;
      --target)
        [[ " ${fuzzers[*]} " == *" $2 "* ]] ||
          fail "fuzz: --target: expected one of ${fuzzers[*]}, got '$2'" 2
        targets=("$2")
        ;;
      *) fail "fuzz: unknown option '$1' (see ./sls $command --help)" 2 ;;
    esac
    shift 2
  done
  setup "${fuzz_packages[@]}"
  local folder="$root/build-fuzz"
  build_tree fuzz "$folder" "${targets[@]/%/_fuzzer}"
  for target in "${targets[@]}"; do
    run_fuzzer "$folder" "$target" $(((seconds + ${#targets[@]} - 1) / ${#targets[@]}))
  done
}

# run_fuzzer FOLDER TARGET SECONDS: keeps new inputs in FOLDER/corpus; ends the launcher at a crash.
run_fuzzer() {
  local corpus="$1/corpus/$2" crashes="$1/crashes/$2" log="$1/$2.log" seeds
  case $2 in
    scenario) seeds=("$root"/config/scenarios "$root"/tests/common/config/invalid) ;;
    qos_file) seeds=("$root"/config/qos "$root"/tests/common/bus/invalid) ;;
    *) seeds=("$root/tests/fuzz/corpus/$2") ;;
  esac
  mkdir -p "$corpus" "$crashes"
  local scratch
  scratch="$(mktemp -d)"  # a target that crashes does not tidy up
  # Libraries from packages are not instrumented, so overflow checks of containers would give false errors.
  if ! TMPDIR=$scratch ASAN_OPTIONS=detect_container_overflow=0 "$1/fuzz/$2_fuzzer" "$corpus" \
    "${seeds[@]}" -max_total_time="$3" -timeout=10 -rss_limit_mb=1024 -max_len=33000 \
    -artifact_prefix="$crashes/" >"$log" 2>&1; then
    rm -rf "$scratch"
    grep -E 'ERROR|SUMMARY|runtime error|what\(\)' "$log" >&2 || true
    fail "$2: crashed (log: $log) with the input $(grep -o "$crashes/[^']\+" "$log" | tail -n 1)"
  fi
  rm -rf "$scratch"
  say "$2: $(tail -n 1 "$log")"
}

cmd_chaos() {
  build_programs chaos
  exec "$build/tests/chaos" "$@"
}

cmd_test() {
  local preset=release folder=$build which=(--label-exclude slow) targets=() only=()
  while (($#)); do
    case "$1 ${2:-}" in
      '--slow '*) which=() ;;
      '--sanitize address') preset=asan; shift ;;
      '--sanitize thread') preset=tsan which=(--label-regex threaded) targets=(threaded_tests); shift ;;
      '--only '?*) only=(--tests-regex "$2"); shift ;;
      *) fail "test: expected --slow, --sanitize address|thread or --only REGEX, got '$*'" 2 ;;
    esac
    shift
  done
  [[ $preset == release ]] || folder="$root/build-$preset"
  setup "${test_packages[@]}" "${python_packages[@]}" "${bench_packages[@]}" \
    "${doc_packages[@]}" "${package_packages[@]}"
  install_node_modules "$root/tests/tools/view"
  build_tree "$preset" "$folder" "${targets[@]}"
  cd "$root"
  # Most tests wait for processes and discovery: one more than there are cores leaves none idle.
  # They must not get variables that the middleware reads from the environment.
  env -u ROS_DISCOVERY_SERVER -u FASTRTPS_DEFAULT_PROFILES_FILE -u FASTDDS_DEFAULT_PROFILES_FILE -u SLS_DOMAIN \
    ctest --preset "$preset" --parallel "$(($(nproc) + 1))" --output-junit "$folder/test.xml" "${which[@]}" "${only[@]}"
}

cmd_reference() {
  install_missing "${python_packages[@]}"
  build_programs "${programs[@]}" _sls_core sls_scenario_keys network_table chaos
  exec /usr/bin/python3 -B "$root/tools/reference" --build "$build" "$@"
}

cmd_docs() {
  setup "${doc_packages[@]}" "${python_packages[@]}"
  build_programs _sls_core  # its docstrings are pages, too
  "$root/docs/api/build.sh" "$build"
  say "pages: $build/docs/index.html"
}

cmd_systems() {
  if [[ " $* " == *' aarch64 '* ]] && ! is_help_asked; then
    install_missing "${python_packages[@]}"
    build_programs "${flying[@]}"  # the other side of its flights
  fi
  exec /usr/bin/python3 -B "$root/tools/systems" "$@"
}

cmd_package() {
  if (($#)); then
    [[ $# == 2 && $1 == --system ]] || fail "package: expected nothing or --system NAME, got '$*'" 2
    cmd_systems --commands package -- "$2"
  fi
  setup "${package_packages[@]}"
  build_tree release "$build" package_contents
  local log="$build/package.log"
  cpack --config "$build/CPackConfig.cmake" -B "$build/package" >"$log" 2>&1 ||
    { tail -n 15 "$log" >&2; fail "cpack failed (whole log: $log)"; }
  say "package: $(sed -n 's/^CPack: - package: \(.*\) generated\.$/\1/p' "$log")"
}

cmd_clean() { rm -rf "$root"/build "$root"/build-*; }

is_installing=1
[[ ${1:-} != --no-install ]] || { is_installing=0; shift; }
command=${1:-help}
(($#)) && shift
if [[ $command != python ]]; then  # its options are the script's
  options=()
  for option; do
    [[ $option == --no-install ]] && is_installing=0 || options+=("$option")
  done
  set -- "${options[@]}"
fi
case $command in
  help | --help | -h)
    if (($# == 0)); then
      usage | sed "s#\./sls#$self#g"
      exit
    fi
    command=$1
    set -- --help
    ;;
esac
arguments=("$@")
[[ $command != python ]] || arguments=("${1:-}")  # the others are the script's
if ! declare -F "cmd_$command" >/dev/null; then
  fail "unknown command '$command' (see ./sls help)" 2
fi
((is_installed == 0)) || [[ " ${source_commands[*]} " != *" $command "* ]] ||
  fail "$command: needs the source tree; this sls is installed without it" 2
if is_help_asked && command_usage "$command"; then
  exit
fi
"cmd_$command" "$@"
