# Completes tfdude's commands, options and frames in bash; installed where bash-completion looks for it.
# It runs tfdude to list frames, partitions and joints, with the network options on the line, for at most half a second.

_tfdude_common() {
  local i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case ${COMP_WORDS[i]} in
      --local) echo --local ;;
      --domain | --profile | --discovery-server) printf '%s\n%s\n' "${COMP_WORDS[i]}" "${COMP_WORDS[i + 1]}" ;;
    esac
  done
}

_tfdude_command() {
  local i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case ${COMP_WORDS[i]} in
      --domain | --profile | --discovery-server | --timeout | --clock) ((++i)) ;;
      -*) ;;
      *) echo "${COMP_WORDS[i]}"; return ;;
    esac
  done
}

# All names in an answer. Its tables shorten long names.
_tfdude_names() {
  timeout 0.5 tfdude "${common[@]}" --json "$1" 2>/dev/null | grep -o '"name":"[^"]*"' | cut -d'"' -f4
}

# The commands of keys, their options, and directories.
_tfdude_keys() {
  local words=
  case $word in
    -*)
      words="--help --json --days"
      case " ${COMP_WORDS[*]} " in
        *" init "*) words+=" --sign --domains" ;;
        *" daemon "*) words+=" --name --look --move --stream --observe --publish-clock" ;;
        *" client "*) words+=" --look --move --stream --observe --publish-clock" ;;
      esac
      mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
      ;;
    *)
      case $previous in
        keys) mapfile -t COMPREPLY < <(compgen -W "init daemon client renew revoke check" -- "$word") ;;
        *) mapfile -t COMPREPLY < <(compgen -d -- "$word") ;;
      esac
      ;;
  esac
}

_tfdude() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} command words common
  local commands="tree frames partitions roots parent children exists lookup velocity watch echo history monitor"
  commands+=" plot graph events joints joint description observe fuse correlate add update remove forget move keys"
  commands+=" record info replay web"
  local of_frames=" parent children exists lookup velocity watch echo plot history observe fuse correlate update "
  of_frames+="remove move "
  local pose="--xyz --rpy --quat --stddev --cov"
  COMPREPLY=()
  command=$(_tfdude_command)
  mapfile -t common < <(_tfdude_common)
  if [[ $command == keys ]]; then
    _tfdude_keys
    return
  fi
  case $previous in
    --profile | --out | --recording) mapfile -t COMPREPLY < <(compgen -f -- "$word"); return ;;
    --domain | --discovery-server | --timeout | --rate | --at | --at-b | --stamp | --gate | --source) return ;;
    --split-size | --split-time) return ;;
    --clock) words="system external" ;;
    --order | --over | --samples | --extrapolate | --wait | --xyz | --rpy | --quat | --stddev) return ;;
    --partition) words=$(_tfdude_names partitions) ;;
    --parent | --fixed) words=$(timeout 0.5 tfdude "${common[@]}" frames 2>/dev/null) ;;
    *)
      if [[ $word == -* ]]; then
        words="--help --domain --local --profile --discovery-server --clock --timeout --json"
        case $command in
          add) words+=" --parent --partition $pose" ;;
          update) words+=" --stamp $pose" ;;
          move) words+=" --parent $pose" ;;
          lookup) words+=" --cov --watch --at --at-b --fixed --extrapolate --age-noise --wait --order --recording" ;;
          velocity) words+=" --cov --at --over" ;;
          correlate) words+=" --unknown --source" ;;
          observe | fuse) words+=" --stamp --gate --correlated $pose" ;;
          watch) words+=" --rate --composed --cov" ;;
          echo) words+=" --rate --composed --recording --at" ;;
          tree) words+=" --watch --recording --at" ;;
          frames | joints | events) words+=" --recording --at" ;;
          record) words+=" --split-size --split-time --raw" ;;
          replay) words+=" --rate --at --loop --paused" ;;
          plot) words+=" --out --samples --at --recording" ;;
          graph) words+=" --out --recording --at" ;;
          joint) words+=" --stddev --stamp" ;;
          monitor) words+=" --rate --once" ;;
        esac
      elif [[ -z $command ]]; then
        words=$commands
      elif [[ $command =~ ^(record|info|replay)$ ]]; then
        mapfile -t COMPREPLY < <(compgen -f -- "$word")
        return
      elif [[ $command == forget ]]; then
        words=$(_tfdude_names partitions)
      elif [[ $command == joint ]]; then
        words=$(_tfdude_names joints)
      elif [[ $of_frames == *" $command "* ]]; then
        words=$(timeout 0.5 tfdude "${common[@]}" frames 2>/dev/null)
      fi
      ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}

complete -F _tfdude tfdude
