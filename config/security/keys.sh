#!/usr/bin/env bash
# ./sls keys: certificate authorities, identities for the roles, and signed governance and permissions
# documents, all made with openssl. README.md explains the files.
set -euo pipefail

here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
readonly here
readonly roles=(server controller recorder operator viewer)

say() { echo "sls: $*" >&2; }
fail() { say "error: $1"; exit "${2:-1}"; }

usage() {
  cat <<'TEXT'
usage: ./sls keys DIR [--days N] [--force] [--other-vendors]
       ./sls keys DIR --add ROLE NAME [--days N] [--force]

Makes DIR: certificate authorities (DIR/ca) and one folder for each role,
server, controller, recorder, operator and viewer, with the identity and the
signed documents of that role.

  --days N         valid for N days, 1 to 36500 (default: 365)
  --force          replace what is there
  --other-vendors  for programs on another vendor's DDS, such as Cyclone DDS:
                   also encrypts submessages, which costs a third of the speed,
                   and does not encrypt discovery (topic names, types, QoS)
  --add ROLE NAME  one more identity of that role in DIR/NAME, signed by the
                   authorities in DIR/ca

Fly with them: SLS_KEYS=DIR ./sls run SCENARIO --qos config/qos/secure.xml
TEXT
}

# --- topics that a role may write and read --------------------------------------------------------
# Every role also writes and reads sls/doctor, through which ./sls doctor queries other hosts.

writes_of() {
  case $1 in
    server) echo sls/state sls/record sls/parameters sls/status sls/control_reply ;;
    controller) echo sls/command sls/participant ;;
    recorder) echo sls/participant ;;
    operator) echo sls/control ;;
    viewer) ;;
  esac
}

reads_of() {
  case $1 in
    server) echo sls/command sls/control sls/participant sls/parameters sls/status ;;
    controller) echo sls/state sls/participant sls/parameters sls/status ;;
    recorder) echo sls/record sls/participant sls/parameters sls/status ;;
    # An operator can also run sls_view and reads the same topics as a viewer.
    operator | viewer)
      echo sls/state sls/command sls/record sls/control sls/control_reply sls/participant sls/parameters sls/status
      ;;
  esac
}

print_topics() {
  local topic
  echo "          <topics>"
  for topic in "$@"; do echo "            <topic>$topic</topic>"; done
  echo "          </topics>"
}

# print_permissions ROLE NAME: prints the document before it is signed.
print_permissions() {
  cat <<TEXT
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
     xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="$2">
      <subject_name>CN=$2,OU=$1,O=SLS</subject_name>
      <validity>
        <not_before>$(date -u -d "@$begin" +%Y-%m-%dT%H:%M:%S)</not_before>
        <not_after>$(date -u -d "@$end" +%Y-%m-%dT%H:%M:%S)</not_after>
      </validity>
      <allow_rule>
        <domains>
          <id_range><min>0</min><max>230</max></id_range>
        </domains>
        <publish>
$(print_topics $(writes_of "$1") sls/doctor)
        </publish>
        <subscribe>
$(print_topics $(reads_of "$1") sls/doctor)
        </subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
TEXT
}

# --- openssl --------------------------------------------------------------------------------------

# Prints the output of openssl only if it failed.
run_openssl() {
  openssl "$@" >"$work/openssl.log" 2>&1 ||
    fail "openssl $1: $(grep -m 1 -E 'rror' "$work/openssl.log" || tail -n 1 "$work/openssl.log")"
}

make_private_key() {
  (umask 077 && run_openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1")
}

# sign_certificate REQUEST CERTIFICATE OPTION…: uses `openssl ca`, the only command that can set the first day.
sign_certificate() {
  local request=$1 certificate=$2
  shift 2
  : >"$work/index.txt"
  run_openssl ca -batch -notext -config "$here/openssl.cnf" -name authority \
    -startdate "$(date -u -d "@$begin" +%Y%m%d%H%M%SZ)" -enddate "$(date -u -d "@$end" +%Y%m%d%H%M%SZ)" \
    -in "$request" -out "$certificate" "$@"
}

sign_document() {
  run_openssl smime -sign -text -in "$1" -out "$2" -signer "$ca/permissions_ca.pem" \
    -inkey "$ca/permissions_ca.key"
}

# make_authority KIND NAME: NAME distinguishes this authority from others in messages.
make_authority() {
  make_private_key "$ca/$1_ca.key"
  run_openssl req -new -config "$here/openssl.cnf" -key "$ca/$1_ca.key" -out "$work/request.pem" \
    -subj "/O=SLS/CN=$1 authority $2"
  sign_certificate "$work/request.pem" "$ca/$1_ca.pem" -selfsign -keyfile "$ca/$1_ca.key" \
    -extensions authority_extensions
}

# Two authorities, because Fast DDS 2.9.1 accepts permissions signed with any certificate of the
# permissions authority: with a single authority, a recorder could sign its own permissions.
make_authorities() {
  mkdir -m 700 "$ca"
  local name
  name="$(openssl rand -hex 4)"
  make_authority identity "$name"
  make_authority permissions "$name"
  # Other vendors' readers send keys only if submessages are protected. Without those keys Fast DDS
  # sends them no samples: common/bus/fastdds/README.md, trap 28.
  # Fast DDS 3 discovers Cyclone DDS only if discovery is not protected: trap 38 there.
  sed -e "s|<metadata_protection_kind>NONE<|<metadata_protection_kind>$submessages<|" \
    -e "s|<discovery_protection_kind>ENCRYPT<|<discovery_protection_kind>$discovery<|" \
    "$here/governance.xml" >"$work/governance.xml"
  sign_document "$work/governance.xml" "$ca/governance.p7s"
}

# make_identity ROLE NAME FOLDER
make_identity() {
  local role=$1 name=$2 folder=$3
  mkdir "$folder"
  make_private_key "$folder/key.pem"
  run_openssl req -new -config "$here/openssl.cnf" -key "$folder/key.pem" -out "$work/request.pem" \
    -subj "/O=SLS/OU=$role/CN=$name"
  sign_certificate "$work/request.pem" "$folder/certificate.pem" \
    -cert "$ca/identity_ca.pem" -keyfile "$ca/identity_ca.key"
  print_permissions "$role" "$name" >"$work/permissions.xml"
  sign_document "$work/permissions.xml" "$folder/permissions.p7s"
  cp "$ca"/{identity_ca.pem,permissions_ca.pem,governance.p7s} "$folder"
}

# --- command line ---------------------------------------------------------------------------------

# replace NEW OLD: renames NEW to OLD. OLD is never partly written.
replace() {
  if [[ -e $2 ]]; then
    mv -T -- "$2" "$work/replaced"
  fi
  mv -T -- "$1" "$2"
}

folder='' days=365 force='' role='' name='' submessages=NONE discovery=ENCRYPT
while (($#)); do
  case $1 in
    --days)
      [[ ${2:-} =~ ^[0-9]{1,5}$ ]] && ((10#$2 >= 1 && 10#$2 <= 36500)) ||
        fail "--days: expected 1 to 36500, got '${2:-}'" 2
      days=$((10#$2))
      shift
      ;;
    --force) force=yes ;;
    --other-vendors) submessages=ENCRYPT discovery=NONE ;;
    --add)
      role=${2:-} name=${3:-}
      [[ " ${roles[*]} " == *" $role "* && -n $role ]] ||
        fail "--add: expected a role (${roles[*]}), got '$role'" 2
      [[ $name =~ ^[A-Za-z0-9_-]{1,32}$ && $name != ca ]] ||
        fail "--add: expected a name of 1 to 32 letters, digits, '_' or '-', not 'ca', got '$name'" 2
      shift 2
      ;;
    --help | -h) usage; exit 0 ;;
    -*) fail "unknown option '$1' (see ./sls keys --help)" 2 ;;
    *)
      [[ -z $folder ]] || fail "expected one folder, got '$folder' and '$1'" 2
      folder=$1
      ;;
  esac
  shift
done
[[ -n $folder ]] || fail "expected a folder (see ./sls keys --help)" 2
folder="$(realpath -m -- "$folder")"

readonly target="$folder${name:+/$name}"
if [[ -n $name && ! -f $folder/ca/identity_ca.key ]]; then
  fail "$folder/ca/identity_ca.key: expected the key of the authority that ./sls keys made, got no such file" 2
fi
if [[ -e $target ]]; then
  [[ -n $force ]] || fail "$target: expected no such folder, got one (--force replaces it)" 2
  [[ -f $target/ca/identity_ca.key || -f $target/permissions.p7s ]] ||
    fail "$target: expected a folder that ./sls keys made, got something else, which --force leaves alone" 2
fi

mkdir -p -- "$(dirname "$target")" || fail "$folder: cannot be made"
# In the target's parent folder: a rename then moves it into place. Unfinished work is removed at exit.
work="$(mktemp -d -- "$(dirname "$target")/.sls-keys-XXXXXX")" || fail "$folder: cannot be written"
trap 'rm -rf -- "$work"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP
export SLS_KEYS_WORK=$work

# Valid from yesterday: hosts with a slow clock or another time zone also accept the certificates.
begin=$(($(date +%s) - 86400))
readonly made="$work/made"
if [[ -n $name ]]; then
  ca="$folder/ca"
  end=$(($(date +%s) + days * 86400))
  make_identity "$role" "$name" "$made"
else
  ca="$made/ca"
  mkdir "$made"
  # The authorities are valid longer than the identities and can renew them (--add ROLE ROLE --force).
  end=$(($(date +%s) + (days > 3650 ? days : 3650) * 86400))
  make_authorities
  end=$(($(date +%s) + days * 86400))
  for role in "${roles[@]}"; do make_identity "$role" "$role" "$made/$role"; done
fi
replace "$made" "$target"
say "keys in $target, valid until $(date -u -d "@$end" +%Y-%m-%d)"
