# Completes tfdude's commands, options, frames, partitions and joints in bash; installed where bash-completion looks for
# it. What may follow is asked of `tfdude __complete`, which answers within 150 ms (docs/cli.md).

_tfdude() {
  local cur words cword answer line
  if declare -F _get_comp_words_by_ref >/dev/null; then
    _get_comp_words_by_ref -n := cur words cword
  else
    cur=${COMP_WORDS[COMP_CWORD]} words=("${COMP_WORDS[@]}") cword=$COMP_CWORD
  fi
  COMPREPLY=()
  # Names come from the network: they are never given to compgen -W, which would expand them as commands.
  mapfile -t answer < <("${words[0]}" __complete "${words[@]:1:cword-1}" "${cur//\\/}" 2>/dev/null)
  case ${answer[0]} in
    :files) mapfile -t COMPREPLY < <(compgen -f -- "$cur"); compopt -o filenames ;;
    :directories) mapfile -t COMPREPLY < <(compgen -d -- "$cur"); compopt -o filenames ;;
    *)
      for line in "${answer[@]}"; do
        printf -v line %q "${line%%$'\t'*}"
        COMPREPLY+=("$line")
      done
      ;;
  esac
  if declare -F __ltrim_colon_completions >/dev/null; then __ltrim_colon_completions "$cur"; fi
}

complete -F _tfdude tfdude
