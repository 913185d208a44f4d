# Completes tfdude's commands, options, frames, partitions and joints in fish; installed where fish looks for it. What
# may follow is asked of `tfdude __complete` (docs/cli.md).

function __tfdude_complete
    set -l words (commandline -opc)
    set -l begun (commandline -ct)
    # Names come from the network: nothing here evaluates them.
    set -l answer ($words[1] __complete $words[2..-1] "$begun" 2>/dev/null)
    switch "$answer[1]"
        case :files
            __fish_complete_path "$begun"
        case :directories
            __fish_complete_directories "$begun"
        case '*'
            string join \n -- $answer
    end
end

complete -c tfdude -f -a '(__tfdude_complete)'
