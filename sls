#!/usr/bin/env bash
# Sets up and builds. The commands are in python/sls/launcher; `./sls help` lists them.
set -euo pipefail
shopt -s extglob

root="$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)"
readonly root
# If installed, this file is PREFIX/share/sls/sls, and nothing is built.
[[ $root == */share/sls && ! -f $root/CMakeLists.txt ]] && is_installed=1 || is_installed=0
readonly is_installed build="${SLS_BUILD:-$root/build}"
readonly flight_packages=(g++ ninja-build cmake libeigen3-dev libsimbody-dev libfastcdr-dev fastddsgen
  default-jre-headless libyaml-cpp-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libssl-dev libtinyxml2-dev
  libzstd-dev zlib1g-dev)
# Of tools, page, Python module and tests.
readonly packages=(make libgtest-dev openssl pybind11-dev python3-dev python3-numpy libboost-dev)
readonly fuzz_packages=(clang libclang-rt-dev llvm)
readonly test_packages=(libgmock-dev libmpfr-dev python3-clang python3-mpmath iproute2 nftables cyclonedds-dev
  cyclonedds-tools fastdds-tools libfaketime locales python3-pandas python3-pytest python3-venv slurm-wlm munge
  python3-distributed chromium mandoc debootstrap
  debian-archive-keyring mmdebstrap git codespell)
readonly python_packages=(python3-numpy python3-scipy python3-matplotlib python3-yaml)
readonly bench_packages=(libbenchmark-dev python3-matplotlib valgrind)
readonly package_packages=(dpkg-dev file python3-yaml)
# The package of Fast DDS on each system, by the code name of the Debian or Ubuntu that it is or is made from.
declare -rA fastdds_packages=([bookworm]=libfastrtps-dev [noble]=libfastrtps-dev [trixie]=libfastdds-dev
  [forky]=libfastdds-dev [resolute]=libfastdds-dev)
readonly too_old=" buster bullseye focal jammy "
readonly tried="Debian 12, 13 and testing, Ubuntu 24.04 and 26.04"

say() { echo "sls: $*" >&2; }
fail() { say "error: $1"; exit "${2:-1}"; }

# --- the environment --------------------------------------------------------------------------------

# Variables that exchange the compiler, its flags or what CMake finds, as conda and a sourced ROS set them.
readonly of_builds=(CC CXX CFLAGS CXXFLAGS CPPFLAGS LDFLAGS CPATH C_INCLUDE_PATH CPLUS_INCLUDE_PATH LIBRARY_PATH
  LD_RUN_PATH GCC_EXEC_PREFIX COMPILER_PATH CMAKE_GENERATOR CMAKE_TOOLCHAIN_FILE CMAKE_PREFIX_PATH CMAKE_PROGRAM_PATH
  CMAKE_INCLUDE_PATH CMAKE_LIBRARY_PATH)

# clean_build: a build gets none of these, and no programs from the folder of another Python, whose cmake would find its
# libraries. Puts what it has dropped into `dropped`.
dropped=()
clean_build() {
  local name folder folders kept=()
  for name in "${of_builds[@]}"; do
    [[ -z ${!name:-} ]] || dropped+=("$name")
    unset "$name"
  done
  IFS=: read -ra folders <<<"$PATH"
  for folder in "${folders[@]}"; do
    if [[ -x $folder/python3 && ! $folder =~ ^(/usr(/local)?)?/s?bin/?$ ]]; then
      dropped+=("PATH=$folder")
    else
      kept+=("$folder")
    fi
  done
  PATH="$(IFS=:; echo "${kept[*]}")"
}

# clean_libraries: drops folders of LD_LIBRARY_PATH with another Fast DDS, Fast CDR or Simbody, which would take the place of
# those that the programs were linked with; says so once.
clean_libraries() {
  local folder kept=() dropped=() folders
  IFS=: read -ra folders <<<"$LD_LIBRARY_PATH"
  for folder in "${folders[@]}"; do
    if compgen -G "$folder/lib@(fastcdr|fastdds|fastrtps|SimTKcommon).so*" >/dev/null; then
      dropped+=("$folder")
    else
      kept+=("$folder")
    fi
  done
  ((${#dropped[@]})) || return 0
  LD_LIBRARY_PATH="$(IFS=:; echo "${kept[*]}")"
  [[ -n $LD_LIBRARY_PATH ]] || unset LD_LIBRARY_PATH
  say "leaves out of LD_LIBRARY_PATH, because of another Fast DDS or Simbody there: ${dropped[*]}"
}

# --- set-up and build -----------------------------------------------------------------------------

# Puts the package of Fast DDS for this system into `fastdds`; a newer one than is known gets what it has. Puts "yes" into
# `is_ubuntu` if it is one. Fails on an older one, and on one without Debian's packages.
expect_system() {
  local name codename like advice="fly in containers with ./sls docker-demo"
  IFS=/ read -r codename like name < <(
    unset ID ID_LIKE PRETTY_NAME VERSION_CODENAME UBUNTU_CODENAME DEBIAN_CODENAME
    [[ ! -r /etc/os-release ]] || . /etc/os-release
    echo "${UBUNTU_CODENAME:-${DEBIAN_CODENAME:-${VERSION_CODENAME:-}}}/${ID:-} ${ID_LIKE:-}/${PRETTY_NAME:-unknown (no /etc/os-release)}"
  )
  [[ " $like " == *' ubuntu '* ]] && is_ubuntu=yes || is_ubuntu=
  fastdds="${fastdds_packages[${codename:-none}]:-}"
  [[ -z $fastdds ]] || return 0
  [[ $too_old != *" ${codename:-none} "* ]] || fail "this system is $name, whose packages are too old; tried are $tried: $advice"
  [[ " $like " =~ ' '(debian|ubuntu)' ' ]] ||
    fail "this system is $name; tried are $tried. Elsewhere $advice, or install by hand what the lists at the top of $root/sls name, then add --no-install"
  fastdds=libfastdds-dev
  [[ -n $(apt-cache policy libfastdds-dev 2>/dev/null) || -z $(apt-cache policy libfastrtps-dev 2>/dev/null) ]] ||
    fastdds=libfastrtps-dev
  unknown="this system is $name, which is not known here: taking $fastdds and the other packages of $tried"
}

# setup_flight [PACKAGE…]: installs the packages for building the programs of a flight, and the given ones.
setup_flight() {
  ((is_installing)) || return 0
  expect_system
  install_missing "${flight_packages[@]}" "$fastdds" "$@"
}

# setup [PACKAGE…]: installs the packages for building everything, and the given ones.
setup() {
  ((is_installed == 0)) || { install_missing "$@"; return; }
  setup_flight "${packages[@]}" "$@"
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
  [[ $version =~ ^v([0-9]+)\. ]] && ((BASH_REMATCH[1] >= 18)) || fail "node: expected version 18 or later, got $version"
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
  [[ -z ${unknown:-} ]] || say "$unknown"
  # Ubuntu's chromium is a snap, which a container cannot install: tests of pages use a browser that there is, or skip.
  [[ -z $is_ubuntu ]] || readarray -t missing < <(printf '%s\n' "${missing[@]}" | grep -vx chromium)
  ((${#missing[@]})) || return 0
  say "installing with apt-get: ${missing[*]}"
  local sudo=() log
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "set-up needs root: apt-get install ${missing[*]}"
    sudo=(sudo)
  fi
  log="$(mktemp)"
  if ! { "${sudo[@]}" apt-get update && say_size "${missing[@]}" && "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y \
    --no-install-recommends "${missing[@]}"; } 3>&2 >"$log" 2>&1; then
    # apt-get update only warns where the network is missing; then packages are unknown.
    fail "apt-get: $(sed -n 's/^E: //p' "$log" | head -n 1)$(
      sed -n 's/^W: Failed to fetch /; /p' "$log" | head -n 1) (whole log: $log)"
  fi
  rm -f "$log"
}

# say_size PACKAGE…: says how much apt-get is going to fetch and to install.
say_size() {
  local size
  size="$("${sudo[@]}" env LC_ALL=C apt-get --assume-no --no-install-recommends install "$@" 2>/dev/null |
    sed -nE 's/^(Need to get|After this operation,) //p' | paste -sd ' ')" || true
  [[ -z $size ]] || say "apt-get: $size" 2>&3
}

# has_tree FOLDER: true if it is a build tree of this checkout made with Ninja, on this version of the system and with the
# Fast DDS that is asked for; false if none, copied or moved.
has_tree() {
  [[ -f $1/build.ninja && -f $1/CMakeCache.txt ]] &&
    [[ $(grep -cxF -e "CMAKE_HOME_DIRECTORY:INTERNAL=$root" -e CMAKE_GENERATOR:INTERNAL=Ninja "$1/CMakeCache.txt") == 2 ]] &&
    ! grep '^SLS_MADE_ON:STRING=.' "$1/CMakeCache.txt" | grep -qvxF "SLS_MADE_ON:STRING=$(describe_place)"
}

# describe_place: the system and the folder of Fast DDS that a build tree is made for.
describe_place() {
  (
    unset ID VERSION_ID VERSION_CODENAME
    [[ ! -r /etc/os-release ]] || . /etc/os-release
    echo "${ID:-} ${VERSION_ID:-${VERSION_CODENAME:-}}${SLS_FASTDDS_PREFIX:+ $SLS_FASTDDS_PREFIX}"
  )
}

# is_built FOLDER TARGET…: true if building would do nothing. Ninja compares every file that the build has read, system
# headers and CMake's files among them, in a twentieth of the time that CMake takes.
is_built() {
  has_tree "$1" && [[ $(ninja -C "$1" -n "${@:2}" 2>/dev/null) == *'ninja: no work to do.' ]]
}

# weigh FOLDER TARGET…: prints for each command of the coming build its weight, a tab, and what Ninja will say of it. A
# file weighs its lines and 600 for what it includes.
weigh() {
  NINJA_STATUS='' ninja -C "$1" -n "${@:2}" | awk -v build="$1" -v root="$root" '
    function count(file,   line, lines) {
      while ((getline line < file) > 0) ++lines
      close(file)
      return lines
    }
    /^ninja: / { next }
    { weight = 50 }
    /^Building C(XX)? object / {
      weight = 600
      source = $NF
      sub(/\.o$/, "", source)
      if (source ~ /\/Unity\//) {
        while ((getline line < (build "/" source)) > 0) if (split(line, part, "\"") == 3) weight += count(part[2])
      } else {
        sub(/CMakeFiles\/[^\/]*\.dir\//, "", source)
        weight += count(root "/" source)
      }
    }
    { print weight "\t" $0 }'
}

# show_progress WEIGHTS: passes on what the build says, and says every 15 s how far it is, once a tenth is done.
show_progress() {
  local line weight all=1 done=0 next=15
  declare -A weights
  while IFS=$'\t' read -r weight line; do
    weights[$line]=$weight
    ((all += weight))
  done <"$1"
  SECONDS=0
  while IFS= read -r line; do
    echo "$line"
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ (.+) ]] || continue
    ((done += ${weights[${BASH_REMATCH[3]}]:-0}, SECONDS >= next && done * 10 >= all)) || continue
    next=$((SECONDS + 15))
    say "built ${BASH_REMATCH[1]} of ${BASH_REMATCH[2]} files; about $((SECONDS * (all - done) / done)) s left"
  done
}

# configure PRESET [--fresh]: if the tree has another compiler than the preset, CMake would keep none of the preset's
# values, and leave out a sanitizer. Then the tree is made anew.
configure() {
  local said status=0 made_on
  made_on="-DSLS_MADE_ON:STRING=$(describe_place)"
  said="$(cmake --preset "$@" "$made_on" 2>&1)" || status=$?
  printf '%s\n' "$said"
  [[ $said != *'require your cache to be deleted'* ]] || { cmake --preset "$1" --fresh "$made_on"; return; }
  return "$status"
}

# build_tree PRESET FOLDER [TARGET…]: configures and builds; all targets by default.
build_tree() {
  local preset=$1 folder=$2 targets=() fresh=() lock log="$2/build.log" began configured
  shift 2
  (($#)) && targets=(--target "$@")
  { mkdir -p "$folder" && : >>"$folder/lock"; } 2>/dev/null ||
    fail "$folder: expected a folder of yours to build in, got one that user $(id -un) cannot write: copy the checkout"
  clean_build
  ((${#dropped[@]} == 0)) || say "the build leaves out of your environment: ${dropped[*]}"
  exec {lock}>"$folder/lock"
  flock "$lock"  # Ninja's files do not survive two builds of one folder at once
  began=$SECONDS
  if ! has_tree "$folder"; then
    fresh=(--fresh)
    rm -f "$folder/Makefile"  # of earlier versions, which built with make
    say "building for the first time, which takes minutes (log: $log)"
  fi
  if ! { (cd "$root" && configure "$preset" "${fresh[@]}") >"$log" 2>&1 &&
    { weigh "$folder" "$@" >"$folder/weights" || true; } && configured=$SECONDS &&
    NINJA_STATUS='[%f/%t] ' cmake --build "$folder" --parallel "$(nproc)" "${targets[@]}" 2>&1 |
      show_progress "$folder/weights" >>"$log"; }; then
    local reason
    reason="$(awk '/^CMake Error/ { found = 1; next } found && NF { sub(/^ +/, ""); text = text " " $0 }
      found && !NF && text { print text; exit }' "$log")"
    [[ -z $reason ]] || fail "CMake:$reason (whole log: $log)"
    grep -E -m 20 'error:|Error |ERROR|undefined reference' "$log" >&2 || tail -n 20 "$log" >&2
    fail "the build failed (whole log: $log)"
  fi
  exec {lock}>&-
  sed -nE 's/^-- (Fast DDS: takes .*SLS_FASTDDS_PREFIX.*)/sls: \1/p' "$log" >&2
  say "$folder: configured in $((configured - began)) s, compiled in $((SECONDS - configured)) s"
}

# build_programs TARGET…: brings the targets up to date. The target `flight` is the programs of a flight: it needs
# neither tools nor tests, unless the tree has them.
build_programs() {
  clean_build
  ! is_built "$build" "$@" || return 0
  if [[ $* == flight ]] && ! { has_tree "$build" && grep -qxF SLS_BUILD_TOOLS:BOOL=ON "$build/CMakeCache.txt"; }; then
    setup_flight
    build_tree flight "$build" "$@"
  else
    setup
    build_tree release "$build" "$@"
  fi
}

# --- actions of the launcher ----------------------------------------------------------------------

# expand NAME…: puts packages into `names`; a name of a list above means the packages of this list.
expand() {
  local name list
  names=()
  for name; do
    list="$name[@]"
    [[ -v $name ]] && names+=("${!list}") || names+=("$name")
  done
}

[[ -z ${LD_LIBRARY_PATH:-} ]] || clean_libraries
is_installing=1
[[ ${1:-} != --no-install || $# == 1 ]] || { is_installing=0; shift; }
[[ ${1:-} == python || " $* " != *' --no-install '* ]] || is_installing=0
[[ $* != 'setup --no-install' ]] || set -- setup
case ${1:-} in
  setup) (($# > 1 || is_installed)) || { setup; exit; } ;;  # also without Python
  @setup) expand "${@:2}"; setup "${names[@]}"; exit ;;
  @install) expand "${@:2}"; install_missing "${names[@]}"; exit ;;
  @npm) install_node_modules "$2"; exit ;;
  @build) build_programs "${@:2}"; exit ;;
  @tree) build_tree "${@:2}"; exit ;;
  @complete) [[ -x /usr/bin/python3 ]] || exit 0 ;;  # installs nothing
esac
[[ -x /usr/bin/python3 ]] || install_missing python3
[[ -x /usr/bin/python3 ]] || fail "/usr/bin/python3: expected Debian's Python, got none: apt-get install python3"
((is_installing)) || set -- --no-install "$@"
unset PYTHONHOME  # of another Python
exec /usr/bin/python3 -BI "$root/python/sls/launcher/__main__.py" "$@"
