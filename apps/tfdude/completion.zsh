#compdef tfdude
# Completes tfdude's commands, options, frames, partitions and joints in zsh; installed where zsh looks for it. What may
# follow is asked of `tfdude __complete` (docs/cli.md).

_tfdude() {
  local -a answer completed shown
  local line
  # Names come from the network: nothing here evaluates them.
  answer=("${(@f)$($words[1] __complete "${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}" 2>/dev/null)}")
  case $answer[1] in
    :files) _files ;;
    :directories) _files -/ ;;
    ?*)
      for line in "$answer[@]"; do
        completed+=("${line%%$'\t'*}")
        shown+=("${line/$'\t'/  -- }")
      done
      compadd -l -d shown -a completed
      ;;
  esac
}

_tfdude "$@"
