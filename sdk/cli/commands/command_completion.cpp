// `defrec completion SHELL`: a script with which a shell completes commands, options and values.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/evaluation/evaluate.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  source <(defrec completion bash)              # for this shell; or for all of yours:\n"
    "  defrec completion bash > ~/.local/share/bash-completion/completions/defrec\n"
    "  defrec completion zsh > ~/.zfunc/_defrec      # a folder of fpath\n"
    "  defrec completion fish > ~/.config/fish/completions/defrec.fish";

struct OptionWords {
    std::string name;                 // --backend
    std::vector<std::string> values;  // one of which it takes; empty: any, or none
    std::string meaning;              // one line
    bool has_value = false;
    bool has_file = false;  // as its value
};
struct CommandWords {
    std::string name, meaning;
    std::vector<OptionWords> options;
    std::vector<std::string> values;  // of the word that stands without an option; empty: any file
};

// The names in {a,b}, as CLI::IsMember describes itself.
std::vector<std::string> members_of(const std::string& type) {
    const std::size_t open = type.find('{'), close = type.find('}');
    std::vector<std::string> members;
    if (open == std::string::npos || close == std::string::npos) return members;
    std::string member;
    for (std::size_t i = open + 1; i <= close; ++i) {
        if (type[i] != ',' && type[i] != '}') {
            member += type[i];
            continue;
        }
        members.push_back(member);
        member.clear();
    }
    return members;
}

std::vector<std::string> values_of(const CLI::Option& option) {
    const auto is = [&](const char* name) {
        return option.check_lname(name) || option.check_sname(name) ||
               option.get_name(true) == name;
    };
    if (is("scene")) return scene_names();
    if (is("backend")) return {"auto", "cpu", "cuda", "vulkan", "reference"};
    if (!is("dataset")) return members_of(option.get_type_name());
    std::vector<std::string> names;
    for (const auto& data_set : data_sets()) names.push_back(data_set->name());
    return names;
}

bool takes_file(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    return type == "DIR" || type == "P" || type == "F" || type.compare(0, 2, "F.") == 0;
}

// Without the characters that shells read as their own.
std::string first_sentence(const std::string& text) {
    std::string line;
    for (const char c : text.substr(0, text.find_first_of(";:\n")))
        if (std::string_view("'`\"[]").find(c) == std::string_view::npos) line += c;
    return line;
}

std::vector<CommandWords> words_of(const CLI::App& app) {
    std::vector<CommandWords> commands;
    for (const CLI::App* command : app.get_subcommands({})) {
        CommandWords words{command->get_name(), first_sentence(command->get_description()), {}, {}};
        for (const CLI::Option* option : command->get_options()) {
            if (option->get_positional() && words.values.empty()) words.values = values_of(*option);
            for (const std::string& name : option->get_lnames())
                words.options.push_back({"--" + name, values_of(*option),
                                         first_sentence(option->get_description()),
                                         option->get_expected_max() != 0, takes_file(*option)});
        }
        commands.push_back(words);
    }
    CommandWords help{"help", "Explain a command", {}, {}};
    for (const CommandWords& command : commands) help.values.push_back(command.name);
    commands.push_back(help);
    return commands;
}

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
    return text;
}

std::string bash(const std::vector<CommandWords>& commands) {
    std::string names, cases, values;
    for (const CommandWords& command : commands) {
        names += (names.empty() ? "" : " ") + command.name;
        std::string options;
        for (const OptionWords& option : command.options) {
            options += (options.empty() ? "" : " ") + option.name;
            if (!option.values.empty())
                values += "    " + command.name + ":" + option.name +
                          ") COMPREPLY=($(compgen -W '" + joined(option.values) +
                          "' -- \"$word\")); return ;;\n";
            else if (option.has_value && !option.has_file)
                values += "    " + command.name + ":" + option.name + ") return ;;\n";
        }
        cases += "    " + command.name + ") options='" + options + "' values='" +
                 joined(command.values) + "' ;;\n";
    }
    return "# Completion of defrec for bash, by `defrec completion bash`.\n"
           "_defrec() {\n"
           "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
           "  local command=${COMP_WORDS[1]} options='' values=''\n"
           "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
           "    COMPREPLY=($(compgen -W '" +
           names +
           " --help --version' -- \"$word\"))\n"
           "    return\n"
           "  fi\n"
           "  case $command:$before in\n" +
           values +
           "  esac\n"
           "  case $command in\n" +
           cases +
           "  esac\n"
           "  case $word:$before:$values in\n"
           "    -*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;;\n"
           "    *:-*:*|*:) COMPREPLY=($(compgen -f -- \"$word\")) ;;\n"
           "    *) COMPREPLY=($(compgen -W \"$values\" -- \"$word\")) ;;\n"
           "  esac\n"
           "}\n"
           "complete -o filenames -F _defrec defrec\n";
}

std::string zsh(const std::vector<CommandWords>& commands) {
    std::string names, cases;
    for (const CommandWords& command : commands) {
        names += "    '" + command.name + ":" + command.meaning + "'\n";
        cases += "      " + command.name + ") _arguments \\\n";
        for (const OptionWords& option : command.options) {
            cases += "        '" + option.name + "[" + option.meaning + "]";
            if (!option.values.empty())
                cases += ":value:(" + joined(option.values) + ")";
            else if (option.has_value)
                cases += option.has_file ? ":value:_files" : ":value: ";
            cases += "' \\\n";
        }
        if (!command.values.empty())
            cases += "        '1:value:(" + joined(command.values) + ")' \\\n";
        cases += "        '*:file:_files' ;;\n";
    }
    return "#compdef defrec\n"
           "# Completion of defrec for zsh, by `defrec completion zsh`.\n"
           "_defrec() {\n"
           "  local -a commands=(\n" +
           names +
           "  )\n"
           "  _arguments -C '1:command:->command' '*::argument:->argument'\n"
           "  case $state in\n"
           "    command) _describe command commands ;;\n"
           "    argument) case $words[1] in\n" +
           cases +
           "    esac ;;\n"
           "  esac\n"
           "}\n"
           "_defrec \"$@\"\n";
}

std::string fish(const std::vector<CommandWords>& commands) {
    std::string text = "# Completion of defrec for fish, by `defrec completion fish`.\n";
    for (const CommandWords& command : commands) {
        text += "complete -c defrec -n __fish_use_subcommand -f -a " + command.name + " -d '" +
                command.meaning + "'\n";
        if (!command.values.empty())
            text += "complete -c defrec -n '__fish_seen_subcommand_from " + command.name +
                    "' -a '" + joined(command.values) + "'\n";
        for (const OptionWords& option : command.options) {
            text += "complete -c defrec -n '__fish_seen_subcommand_from " + command.name + "' -l " +
                    option.name.substr(2) + " -d '" + option.meaning + "'";
            if (!option.values.empty())
                text += " -x -a '" + joined(option.values) + "'";
            else if (option.has_value)
                text += option.has_file ? " -r -F" : " -x";
            text += "\n";
        }
    }
    return text;
}

}  // namespace

CLI::App* add_completion_command(CLI::App& app, std::function<int()>& run) {
    auto shell = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand(
        "completion", "Print a script with which a shell completes what is typed");
    command->add_option("SHELL", *shell, "bash, zsh or fish")
        ->required()
        ->check(CLI::IsMember({"bash", "zsh", "fish"}));
    command->footer(kFooter);
    command->callback([shell, &app, &run] {
        run = [shell, &app] {
            const std::vector<CommandWords> words = words_of(app);
            print(*shell == "bash" ? bash(words) : *shell == "zsh" ? zsh(words) : fish(words));
            return static_cast<int>(ExitCode::kOk);
        };
    });
    return command;
}

}  // namespace defrec::cli
