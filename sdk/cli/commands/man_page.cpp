// See man_page.hpp.
#include "sdk/cli/commands/man_page.hpp"

#include <CLI/CLI.hpp>
#include <sstream>

#include "sdk/cli/commands/help_text.hpp"

namespace defrec::cli {
namespace {

// The program of this name has its commands bench and devices, and the same page.
constexpr char kBench[] = "bench";

// Text as roff takes it: hyphens that can be copied, and nothing that is a command of its own.
std::string roff(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else if (c == '\'')
            result += "\\(aq";
        else if (c == '`')
            result += "\\(ga";
        else if (c == '"')
            result += "\\(dq";
        else if (c == '^')
            result += "\\(ha";
        else if (c == '~')
            result += "\\(ti";
        else
            result += c;
    }
    return result;
}

// A line that begins with a dot would be a request.
std::string roff_line(const std::string& line) {
    return (line.empty() || line.front() != '.' ? "" : "\\&") + roff(line) + "\n";
}

std::string upper(std::string text) {
    for (char& c : text)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return text;
}

std::string head(const std::string& name, const std::string& meaning, const std::string& version) {
    return ".\\\" Written by the build from the definitions of the program's options.\n.TH " +
           roff(upper(name)) + " 1 \"\" \"defrec " + version + "\" \"User Commands\"\n.SH NAME\n" +
           roff(name) + " \\- " + roff(meaning) + "\n";
}

// Paragraphs; lines that begin with two blanks stay as they are.
std::string paragraphs(const std::string& text) {
    std::istringstream lines(text);
    std::string result;
    bool is_kept = false;
    for (std::string line; std::getline(lines, line);) {
        const bool keeps = line.compare(0, 2, "  ") == 0;
        if (keeps != is_kept) result += keeps ? ".PP\n.nf\n" : ".fi\n.PP\n";
        is_kept = keeps;
        result += line.empty() ? ".PP\n" : roff_line(keeps ? line.substr(2) : line);
    }
    return is_kept ? result + ".fi\n" : result;
}

std::string option_entry(const OptionHelp& option) {
    return ".TP\n.B " + roff(option.name) + "\n" + roff_line(option.meaning);
}

std::string see_also(const CLI::App& program, const std::string& name) {
    std::string pages = name == program.get_name() ? "" : "defrec(1)";
    for (const CLI::App* command : program.get_subcommands({}))
        if (command->get_name() != name)
            pages += (pages.empty() ? "" : ", ") + ("defrec-" + command->get_name()) + "(1)";
    return ".SH SEE ALSO\n" + roff(pages) +
           ", defrec\\-conformance(1).\nThe guides are in the package defrec\\-doc.\n";
}

}  // namespace

std::string man_page(const CLI::App& command, const std::string& version) {
    const std::string& name = command.get_name();
    std::string page = head("defrec-" + name, command.get_description(), version);
    std::string arguments, options, values;
    for (const CLI::Option* option : command.get_options()) {
        const OptionHelp help = help_of(*option);
        if (option->get_positional()) arguments += " " + help.name;
        (option->get_positional() ? values : options) += option_entry(help);
    }
    page += ".SH SYNOPSIS\n.B defrec " + roff(name + arguments) + "\n.RI [ OPTION .\\|.\\|.]\n";
    if (name == kBench)
        page +=
            ".br\n.B defrec\\-bench devices\n.br\n.B defrec\\-bench bench\n.RI [ OPTION "
            ".\\|.\\|.]\n";
    page += ".SH DESCRIPTION\n" + roff_line(command.get_description() + ".");
    if (name == kBench)
        page +=
            ".PP\nThe program\n.B defrec\\-bench\nhas this command and\n.B devices\nalone, so "
            "it needs few libraries.\n";
    if (!values.empty()) page += ".SH ARGUMENTS\n" + values;
    page += ".SH OPTIONS\n" + options;
    if (!command.get_footer().empty()) page += ".SH NOTES\n" + paragraphs(command.get_footer());
    return page + see_also(*command.get_parent(), name);
}

std::string man_page_of_program(const CLI::App& program, const std::string& version) {
    std::string page =
        head("defrec", "recover how a tissue surface deforms in stereo video", version);
    page +=
        ".SH SYNOPSIS\n.B defrec\n.I COMMAND\n.RI [ OPTION .\\|.\\|.]\n.SH DESCRIPTION\n"
        ".B defrec\nrecovers in real time how a tissue surface deforms in stereo endoscope or "
        "microscope video, and where given points of it are in each frame. Each command has a "
        "page of its own, as\n.BR defrec\\-track (1).\n.SH COMMANDS\n";
    for (const CLI::App* command : program.get_subcommands({}))
        page += ".TP\n.BR defrec\\-" + roff(command->get_name()) + " (1)\n" +
                roff_line(command->get_description());
    page += ".SH OPTIONS\n";
    for (const CLI::Option* option : program.get_options()) page += option_entry(help_of(*option));
    page += ".SH NOTES\n" + paragraphs(program.get_footer());
    return page + see_also(program, program.get_name());
}

}  // namespace defrec::cli
