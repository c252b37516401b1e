# Completion of ./sls and sls in bash. To use it: source tools/completion/sls.bash
# The launcher answers: python/sls/launcher/completion.py. tests/launcher/completion_test.py completes with it.
# shellcheck shell=bash

_sls() {
  local current=${COMP_WORDS[COMP_CWORD]} kind='' words=()
  # The first line is the kind of files that fit, the others are words.
  { IFS= read -r kind; mapfile -t words; } \
    < <("${COMP_WORDS[0]/#\~/$HOME}" @complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
  mapfile -t COMPREPLY < <({
    compgen -W "${words[*]}" -- "$current"
    case $kind in
      file) compgen -f -- "$current" ;;
      dir) compgen -d -- "$current" ;;
      yaml) compgen -f -X '!*.yaml' -- "$current"; compgen -d -- "$current" ;;
    esac
  } | sort -u)
  [[ -z $kind ]] || compopt -o filenames 2>/dev/null
  return 0
}

# Bash uses it for every path that ends in sls, ./sls too.
complete -F _sls sls
