#!/usr/bin/env bash
# What security costs: flies figure_eight at 1 ms, and short, with each profile in turn, ROUNDS times (5),
# and prints the medians: steps/s and its ratio to udp, and the seconds of a whole short flight, most of
# which is discovery.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
readonly root rounds="${1:-5}" domain="${SLS_DOMAIN:-99}"
readonly profiles=(default udp lan secure)
work="$(mktemp -d)"
trap 'rm -rf -- "$work"' EXIT
export SLS_KEYS="$work/keys"
"$root/sls" keys "$SLS_KEYS" 2>/dev/null

# fly SCENARIO PROFILE [OPTION…]: what the programs say.
fly() {
  local scenario=$1 profile=$2
  shift 2
  "$root/sls" run "$scenario" --qos "$root/config/qos/$profile.xml" --domain "$domain" \
    --out "$work/recording" --force "$@" 2>&1
}

median() { sort -n "$1" | awk '{ value[NR] = $1 } END { print value[int((NR + 1) / 2)] }'; }

for ((round = 1; round <= rounds; ++round)); do
  for profile in "${profiles[@]}"; do
    fly figure_eight "$profile" --period-s 0.001 | sed -n 's/.* \([0-9]*\) steps\/s.*/\1/p' >>"$work/$profile.speed"
    began=$(date +%s%N)
    fly short "$profile" >"$work/said"
    echo $((($(date +%s%N) - began) / 1000000)) >>"$work/$profile.time"
  done
done

printf '%-10s %10s %10s %14s\n' profile steps/s 'of udp' 'short flight'
udp="$(median "$work/udp.speed")"
for profile in "${profiles[@]}"; do
  speed="$(median "$work/$profile.speed")"
  printf '%-10s %10d %9d%% %11d ms\n' "$profile" "$speed" $((100 * speed / udp)) "$(median "$work/$profile.time")"
done
