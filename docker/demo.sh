# ./sls docker-demo: flies one of the compose files. The launcher sources this file, which uses its functions.

docker_usage() {
  cat <<'TEXT'
usage: ./sls docker-demo [NAME] [--scenario SCENARIO] [--out DIR]
       ./sls docker-demo --build          build only the image, for use with docker compose

Builds the image, flies in containers and prints the summary of ./sls demo. NAME is one of
  plain      server, controller, recorder on a network of containers (default)
  discovery  the same through a discovery server
  standby    two controllers; the first is killed in flight
  secure     with DDS Security; SLS_KEYS: the folder that ./sls keys made (default: new keys)
  fleet      eight vehicles: one server flies 0 to 3, another 4 to 7, on the same domain

SCENARIO is a name in config/scenarios or a path (default: figure_eight); DIR the folder of the
recording, new or empty (default: recordings/docker-NAME-UTCTIME); for a fleet it has a folder for each
server's vehicles, 0-3 and 4-7. SLS_IMAGE names an existing image to use; SLS_SYSTEM the system of a new
one, debian12 or debian13 (default: debian12); SLS_BASE its base (default: debian:bookworm-slim or
debian:trixie-slim). Needs a Docker engine with docker compose or docker-compose.
TEXT
}

# --- the image ------------------------------------------------------------------------------------

find_compose() {
  docker version >/dev/null 2>&1 ||
    fail "no Docker engine answers: expected one, such as of apt-get install docker.io docker-compose"
  if docker compose version >/dev/null 2>&1; then
    compose=(docker compose)
  elif command -v docker-compose >/dev/null; then
    compose=(docker-compose)
  else
    fail "expected docker compose or docker-compose, got neither: apt-get install docker-compose"
  fi
}

make_base() {
  ! docker image inspect "$1" >/dev/null 2>&1 || return 0
  say "pulling $1"
  ! timeout 120 docker pull --quiet "$1" >/dev/null 2>&1 || return 0
  say "no image registry gives it: making it from Debian's packages"
  ((EUID == 0)) || fail "this needs root once: sudo docker/base-image.sh $1"
  command -v debootstrap >/dev/null || setup debootstrap
  "$root/docker/base-image.sh" "$1"
}

build_image() {
  [[ -z ${SLS_IMAGE:-} ]] || return 0
  local system=${SLS_SYSTEM:-debian12} log base
  case $system in
    debian12) base=debian:bookworm-slim ;;
    debian13) base=debian:trixie-slim ;;
    *) fail "SLS_SYSTEM: expected one of ${systems[*]}, got '$system'" 2 ;;
  esac
  base=${SLS_BASE:-$base}
  make_base "$base"
  if command -v npm >/dev/null; then
    install_node_modules "$root/tools/view/page"  # this machine may trust a proxy that the base image does not
  fi
  log="$(mktemp)"
  say "building the image sls for $system, for the first time some minutes (log: $log)"
  # An engine without BuildKit pulls the base of both systems, so both are the one that is here.
  if ! docker build --build-arg "SYSTEM=$system" --build-arg "DEBIAN12=$base" --build-arg "DEBIAN13=$base" \
    -f "$root/docker/Dockerfile" -t sls -t "sls:$system" "$root" >"$log" 2>&1; then
    grep -E -m 20 'error|Error' "$log" >&2 || tail -n 20 "$log" >&2
    fail "the image was not built (whole log: $log)"
  fi
  rm -f "$log"
}

# --- the flight -----------------------------------------------------------------------------------

# Removes containers, their network and copies of keys; makes root the owner of the recording if root is the caller.
clean_up() {
  trap '' INT TERM HUP
  signal_all TERM
  ((killer == 0)) || kill "$killer" 2>/dev/null || true
  "${compose[@]}" "${flags[@]}" down --volumes --timeout 30 >/dev/null 2>&1 ||
    say "warning: docker compose down failed: see docker ps --all"
  rm -rf -- "$scratch"
  ((EUID != 0)) || chown -R 0:0 -- "$recording"
}

container_of() {
  docker ps --all --quiet --filter "label=com.docker.compose.project=$project" \
    --filter "label=com.docker.compose.service=$1"
}

# start_service NAME: starts a process that passes on signals, output and exit code of the container.
start_service() {
  local id
  id="$(container_of "$1")"
  setpriv --pdeathsig TERM -- docker start --attach "$id" >&2 &
}

# Kills the first controller once the recording has 800 of its steps.
kill_in_flight() {
  local id
  id="$(container_of controller)"
  until [[ $(grep -c ,primary, "$recording/command.csv" 2>/dev/null) -gt 800 ]]; do
    kill -0 $$ 2>/dev/null || return 0  # the launcher was killed
    sleep 0.02
  done
  docker kill "$id" >/dev/null 2>&1 && say "killed the first controller"
}

fly_in_containers() {
  local name=$1 service services=(recorder server controller)
  "${compose[@]}" "${flags[@]}" up --no-start >"$scratch/log" 2>&1 ||
    { tail -n 5 "$scratch/log" >&2; fail "the containers were not made"; }
  ((interrupted == 0)) || exit "$interrupted"
  case $name in
    fleet) services=({recorder,server,controller}-{0-3,4-7}) ;;
    discovery) docker start "$(container_of discovery)" >/dev/null ;;
    standby)
      # Not in name_of, so that its end does not end the flight.
      start_service controller
      services=(recorder server standby)
      kill_in_flight &
      killer=$!
      ;;
  esac
  for service in "${services[@]}"; do
    start_service "$service"
    name_of[$!]=$service
  done
  wait_all
}

# make_fleet_scenario FILE: prints FILE; adds `vehicles: 8` if FILE does not have this key.
make_fleet_scenario() {
  cat -- "$1"
  grep -q '^vehicles:' -- "$1" || printf '\nvehicles: 8\n'
}

docker_demo() {
  local name='' scenario=figure_eight
  recording=''
  while (($#)); do
    case $1 in
      --scenario | --out)
        (($# >= 2)) || fail "$1: expected a value (see ./sls docker-demo --help)" 2
        [[ $1 == --out ]] && recording=$2 || scenario=$2
        shift
        ;;
      --build) name=build ;;
      --help | -h) docker_usage; return 0 ;;
      plain | discovery | standby | secure | fleet)
        [[ -z $name ]] || fail "expected one name, got '$name' and '$1'" 2
        name=$1
        ;;
      *) fail "docker-demo: expected plain, discovery, standby, secure or fleet, got '$1'" 2 ;;
    esac
    shift
  done
  if [[ $name == build ]]; then
    find_compose
    build_image
    return 0
  fi
  name=${name:-plain}
  local file
  file="$(realpath -- "$(find_scenario "$scenario")")"
  [[ -f $file ]] || fail "$file: expected a scenario, got no such file" 2
  recording="$(realpath -m -- "${recording:-recordings/docker-$name-$(date -u +%Y%m%dT%H%M%SZ)}")"
  [[ ! -e $recording || (-d $recording && -z $(ls -A -- "$recording")) ]] ||
    fail "$recording: expected a new or empty folder, got files in it" 2

  find_compose
  build_image

  local suffix=".$name"
  [[ $name != plain ]] || suffix=''
  project="sls-demo-$$"
  flags=(--project-name "$project" --file "$root/docker/compose$suffix.yaml")
  killer=0
  scratch="$(mktemp -d)"
  trap 'on_signal 130 TERM' INT
  trap 'on_signal 143 TERM' TERM HUP
  trap clean_up EXIT
  local parts=("$recording") part
  [[ $name != fleet ]] || parts+=("$recording"/{0-3,4-7})
  mkdir -p -- "${parts[@]}"
  # No program runs as root. If the caller is root, the image's user owns the folders during the flight.
  local user
  user="$(id -u):$(id -g)"
  if ((EUID == 0)); then
    user=1000:1000
    chown "$user" -- "${parts[@]}"
  fi
  if [[ $name == secure ]]; then
    if [[ -n ${SLS_KEYS:-} ]]; then
      cp -r -- "$SLS_KEYS" "$scratch/keys"
    else
      "$root/config/security/keys.sh" "$scratch/keys"
    fi
    chown -R "$user" "$scratch/keys"
    export SLS_KEYS="$scratch/keys"
  fi
  export SLS_USER=$user SLS_RECORDING=$recording SLS_SCENARIO=$file
  if [[ $name == fleet ]]; then
    export SLS_SCENARIO="$scratch/scenario.yaml"
    make_fleet_scenario "$file" >"$SLS_SCENARIO"
    chmod a+rx -- "$scratch"
  fi

  say "flying $(basename "$file" .yaml) with docker/compose$suffix.yaml"
  fly_in_containers "$name"
  ((result == 0)) || exit "$result"
  [[ $name != fleet ]] || parts=("${parts[@]:1}")
  for part in "${parts[@]}"; do (recording=$part && print_summary); done
}
