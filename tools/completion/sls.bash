# Completion of ./sls and sls in bash. To use it: source tools/completion/sls.bash
# Generated from the help of ./sls and of the programs by ./sls reference; changes here are lost.
# tests/docs/completion_test.py completes with it. shellcheck shell=bash

_sls_commands="bench build campaign campaign-worker chaos check clean convert ctl delay-margin demo discovery-server docker-demo docs doctor fuzz help keys list network-table package plot python reference report run setup study systems test verify view worlds"
declare -gA _sls_options=(
  ["bench"]="--help --quick --json --only --out"
  ["build"]="--help"
  ["campaign"]="--help --out --on --workers --runs --resume --verify --domain --chunk-runs --sbatch --scheduler --allow-other-machines --allow-broken-measures"
  ["campaign-worker"]="--help --chunks"
  ["chaos"]="--help --trials --seed --faults --verbose"
  ["check"]="--help --junit --json --report --repeat --placement --under --library --jobs --update --recording"
  ["clean"]="--help"
  ["convert"]="--help --out --force --version"
  ["ctl"]="--help --qos --domain --log-level --version --vehicle --timeout-s --watch --json"
  ["delay-margin"]="--help --period-s --vehicle"
  ["demo"]="--help --out --force --qos --domain --period-s --mode --rtf --in-process --view --view-port"
  ["discovery-server"]="--help --listen --port"
  ["docker-demo"]="--help --scenario --out --build"
  ["docs"]="--help"
  ["doctor"]="--help --qos --domain --log-level --version --peer --identity --json --answer --for-s"
  ["fuzz"]="--help --seconds --target"
  ["help"]="--help"
  ["keys"]="--help --days --force --other-vendors --mixed-versions --add"
  ["list"]="--help"
  ["network-table"]="--help --profile --faults --disturbance --vehicles"
  ["package"]="--help --system"
  ["plot"]="--help --out --name --vehicle --format --rod-length-m --panels --paper"
  ["python"]="--help"
  ["reference"]="--help --build --man --check"
  ["report"]="--help --vehicle"
  ["run"]="--help --out --force --qos --domain --period-s --mode --rtf --in-process --view --view-port --json"
  ["setup"]="--help"
  ["study"]="--help --out --recordings --reuse"
  ["systems"]="--help --commands --only --limit-minutes --need-gib --folder --keep"
  ["test"]="--help --slow --sanitize --only"
  ["verify"]="--help --version"
  ["view"]="--help --qos --domain --log-level --version --vehicle --listen --port --token-file --read-only --allow-origin --ros --identity --export --most-bytes"
  ["worlds"]="--help --version --scenario --faults --seeds --jobs --most --table --replay --verbose"
)
declare -gA _sls_subcommands=(
  ["campaign"]="status report compare"
  ["ctl"]="pause step resume start reset stop status"
)
declare -gA _sls_positionals=(
  ["campaign"]="campaign"
  ["campaign-worker"]="dir"
  ["check"]="check"
  ["convert"]="dir"
  ["delay-margin"]="scenario"
  ["demo"]="scenario"
  ["help"]="bench build campaign campaign-worker chaos check clean convert ctl delay-margin demo discovery-server docker-demo docs doctor fuzz help keys list network-table package plot python reference report run setup study systems test verify view worlds"
  ["keys"]="dir"
  ["plot"]="dir"
  ["report"]="dir"
  ["run"]="scenario"
  ["verify"]="dir"
  ["view"]="dir"
)
declare -gA _sls_arguments=(
  ["bench --json"]="file"
  ["bench --only"]="lockstep load realtime plant start instructions"
  ["bench --out"]="dir"
  ["campaign --chunk-runs"]="any"
  ["campaign --domain"]="any"
  ["campaign --on"]="local slurm dask"
  ["campaign --out"]="dir"
  ["campaign --runs"]="any"
  ["campaign --sbatch"]="any"
  ["campaign --scheduler"]="any"
  ["campaign --verify"]="any"
  ["campaign --workers"]="any"
  ["campaign-worker --chunks"]="any"
  ["chaos --faults"]="file"
  ["chaos --seed"]="any"
  ["chaos --trials"]="any"
  ["check --jobs"]="any"
  ["check --json"]="file"
  ["check --junit"]="file"
  ["check --library"]="file"
  ["check --placement"]="in-process shm udp hosts worlds"
  ["check --recording"]="dir"
  ["check --repeat"]="any"
  ["check --report"]="dir"
  ["check --under"]="any"
  ["convert --out"]="file"
  ["ctl --domain"]="any"
  ["ctl --log-level"]="debug info warning error"
  ["ctl --qos"]="file"
  ["ctl --timeout-s"]="any"
  ["ctl --vehicle"]="any"
  ["delay-margin --period-s"]="any"
  ["delay-margin --vehicle"]="any"
  ["demo --domain"]="any"
  ["demo --mode"]="lockstep realtime"
  ["demo --out"]="dir"
  ["demo --period-s"]="any"
  ["demo --qos"]="file"
  ["demo --rtf"]="any"
  ["demo --view-port"]="any"
  ["discovery-server --listen"]="any"
  ["discovery-server --port"]="any"
  ["docker-demo --out"]="dir"
  ["docker-demo --scenario"]="scenario"
  ["doctor --domain"]="any"
  ["doctor --for-s"]="any"
  ["doctor --identity"]="any"
  ["doctor --log-level"]="debug info warning error"
  ["doctor --peer"]="any"
  ["doctor --qos"]="file"
  ["fuzz --seconds"]="any"
  ["fuzz --target"]="scenario faults qos_file csv recording samples foxglove web"
  ["keys --add"]="any"
  ["keys --days"]="any"
  ["keys --mixed-versions"]="any"
  ["network-table --disturbance"]="any"
  ["network-table --faults"]="file"
  ["network-table --profile"]="any"
  ["network-table --vehicles"]="any"
  ["package --system"]="any"
  ["plot --format"]="matlab-setpoint matlab-trajectory gazebo px4"
  ["plot --name"]="any"
  ["plot --out"]="dir"
  ["plot --panels"]="any"
  ["plot --paper"]="any"
  ["plot --rod-length-m"]="any"
  ["plot --vehicle"]="any"
  ["reference --build"]="dir"
  ["reference --man"]="dir"
  ["report --vehicle"]="any"
  ["run --domain"]="any"
  ["run --mode"]="lockstep realtime"
  ["run --out"]="dir"
  ["run --period-s"]="any"
  ["run --qos"]="file"
  ["run --rtf"]="any"
  ["run --view-port"]="any"
  ["study --out"]="dir"
  ["study --recordings"]="dir"
  ["systems --commands"]="any"
  ["systems --folder"]="dir"
  ["systems --limit-minutes"]="any"
  ["systems --need-gib"]="any"
  ["systems --only"]="any"
  ["test --only"]="any"
  ["test --sanitize"]="any"
  ["view --allow-origin"]="any"
  ["view --domain"]="any"
  ["view --export"]="file"
  ["view --identity"]="any"
  ["view --listen"]="any"
  ["view --log-level"]="debug info warning error"
  ["view --most-bytes"]="any"
  ["view --port"]="any"
  ["view --qos"]="file"
  ["view --token-file"]="file"
  ["view --vehicle"]="any"
  ["worlds --faults"]="file"
  ["worlds --jobs"]="any"
  ["worlds --most"]="any"
  ["worlds --replay"]="any"
  ["worlds --scenario"]="file"
  ["worlds --seeds"]="any"
  ["worlds --table"]="file"
)

# _sls_names KIND: names of the scenarios, campaigns or checks that the launcher finds.
_sls_names() {
  local launcher folder file
  launcher="$(type -P -- "${COMP_WORDS[0]/#\~/$HOME}")" || launcher=$PWD/sls
  folder="$(dirname -- "$(readlink -f -- "$launcher")")"
  for folder in "$folder/config" "$folder/../share/sls/config" /usr/share/sls/config; do
    for file in "$folder/$1"/*.yaml; do
      [[ -f $file ]] || continue
      file=${file##*/}
      echo "${file%.yaml}"
    done
  done
}

# _sls_values KIND WORD: what WORD can become. KIND is file, dir, scenario, campaign, check or the values themselves.
_sls_values() {
  case $1 in
    file) compgen -f -- "$2" ;;
    dir) compgen -d -- "$2" ;;
    scenario) compgen -W "$(_sls_names scenarios)" -- "$2"; compgen -f -X '!*.yaml' -- "$2"; compgen -d -- "$2" ;;
    campaign | check) compgen -W "$(_sls_names "$1"s)" -- "$2"; compgen -f -X '!*.yaml' -- "$2"; compgen -d -- "$2" ;;
    any) ;;
    *) compgen -W "$1" -- "$2" ;;
  esac
}

_sls() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]} kind=''
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    kind=$_sls_commands
  elif [[ -n ${_sls_arguments["$command $previous"]-} ]]; then
    kind=${_sls_arguments["$command $previous"]}
  elif [[ $current == -* ]]; then
    kind=${_sls_options["$command"]-}
  elif [[ -n ${_sls_subcommands["$command"]-} ]] && ((COMP_CWORD == 2)); then
    mapfile -t COMPREPLY < <(compgen -W "${_sls_subcommands["$command"]}" -- "$current")
    kind=${_sls_positionals["$command"]-any}
  else
    kind=${_sls_positionals["$command"]-file}
  fi
  local values
  mapfile -t values < <(_sls_values "$kind" "$current" | sort -u)
  COMPREPLY+=("${values[@]}")
  case $kind in
    file | dir | scenario | campaign | check) compopt -o filenames 2>/dev/null ;;
  esac
  return 0
}

# Bash uses it for every path that ends in sls, ./sls too.
complete -F _sls sls
