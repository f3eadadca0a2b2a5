// See suggestion.hpp.
#include "sdk/cli/commands/suggestion.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "sdk/cli/commands/help_text.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

std::string unknown(const std::string& what, const std::string& name,
                    const std::vector<std::string>& known, const std::string& help) {
    std::string text = "there is no " + what + " '" + name + "'.";
    const std::string nearest = nearest_name(name, known);
    if (!nearest.empty()) text += " Did you mean " + nearest + "?";
    return text + " " + help + " lists all.";
}

const CLI::App* command_of(const CLI::App& app, const std::string& name) {
    for (const CLI::App* command : app.get_subcommands({}))
        if (command->check_name(name)) return command;
    return nullptr;
}

bool takes_options_alone(const CLI::App& command) {
    const std::vector<const CLI::Option*> options = command.get_options();
    return command.get_subcommands({}).empty() &&
           std::none_of(options.begin(), options.end(),
                        [](const CLI::Option* option) { return option->get_positional(); });
}

std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

std::string list_of_commands(const CLI::App& app) {
    std::string text = "a command is missing. There are:\n";
    for (const CLI::App* command : app.get_subcommands({}))
        text += HelpText(help_width()).make_subcommand(command);
    return text + app.get_name() + " COMMAND --help explains each.";
}

// "--calibration, --out and --truth"
std::string enumeration(const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
        text += names[i];
    }
    return text;
}

// The first of the command's examples, a line with its end; empty where it has none.
std::string example_of(const CLI::App& app, const CLI::App& command) {
    const std::string start = "\n  " + app.get_name() + " " + command.get_name() + " ";
    const std::string& footer = command.get_footer();
    const std::size_t at = footer.find(start);
    if (at == std::string::npos) return {};
    return footer.substr(at + 1, footer.find('\n', at + 1) - at - 1) + "\n";
}

}  // namespace

std::string what_is_missing(const CLI::App& app, int argc, const char* const* argv) {
    if (app.get_subcommands({}).empty()) return {};
    if (argc < 2) return list_of_commands(app);
    const CLI::App* command = command_of(app, argv[1]);
    if (command == nullptr) return {};
    std::vector<std::string> missing;
    for (const CLI::Option* option : command->get_options())
        if (option->get_required() && option->count() == 0)
            missing.push_back(help_of(*option).name);
    if (missing.empty()) return {};
    const std::string example = example_of(app, *command);
    return command->get_name() + " needs " + enumeration(missing) +
           (example.empty() ? ". " : ", as in\n" + example) + app.get_name() + " " +
           command->get_name() + " --help lists all.";
}

std::string misspelling(const CLI::App& app, int argc, const char* const* argv) {
    if (argc < 2 || argv[1][0] == '-') return {};
    const CLI::App* command = command_of(app, argv[1]);
    if (command == nullptr) {
        std::vector<std::string> names;
        for (const CLI::App* each : app.get_subcommands({})) names.push_back(each->get_name());
        return unknown("command", argv[1], names, app.get_name() + " --help");
    }
    if (argc > 2 && argv[2][0] != '-' && takes_options_alone(*command))
        return "'" + std::string(argv[2]) + "' stands without the option that it belongs to. " +
               app.get_name() + " " + command->get_name() + " --help lists all.";
    const std::vector<std::string> known = option_names(*command);
    for (int i = 2; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--") break;
        if (argument.compare(0, 2, "--") != 0) continue;
        const std::string name = argument.substr(0, argument.find('='));
        if (std::find(known.begin(), known.end(), name) == known.end())
            return unknown("option", name, known,
                           app.get_name() + " " + command->get_name() + " --help");
    }
    return {};
}

}  // namespace defrec::cli
