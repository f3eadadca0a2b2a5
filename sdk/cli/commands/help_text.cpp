// See help_text.hpp.
#include "sdk/cli/commands/help_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <vector>

#if __has_include(<sys/ioctl.h>)
#include <sys/ioctl.h>
#include <unistd.h>
#endif

namespace defrec::cli {
namespace {

constexpr std::size_t kNarrowest = 40, kWidest = 120, kUsual = 80;
constexpr std::size_t kNameColumns = 26, kNarrow = 64, kIndent = 6;

// As people write it: 1000000, 0.000001.
std::string plain_number(const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end == text.c_str()) return text;
    char number[64];
    std::snprintf(number, sizeof number, "%.6f", value);
    std::string plain = number;
    plain.erase(plain.find_last_not_of('0') + 1);
    if (plain.back() == '.') plain.pop_back();
    return plain;
}

// "0.001 to 10000" of "FLOAT in [0.001 - 10000]"; other checks have nothing to add to the text.
std::string range_in_words(const std::string& check) {
    const std::size_t open = check.find(" in ["), between = check.find(" - "),
                      close = check.find(']');
    if (open == std::string::npos || between == std::string::npos || close == std::string::npos)
        return {};
    return plain_number(check.substr(open + 5, between - open - 5)) + " to " +
           plain_number(check.substr(between + 3, close - between - 3));
}

std::vector<std::string> checks_of(const CLI::Option& option) {
    std::vector<std::string> checks;
    // Its list can only be asked for one by one, of an option that may be changed.
    auto& open = const_cast<CLI::Option&>(option);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    try {
        for (int i = 0;; ++i) checks.push_back(open.get_validator(i)->get_description());
    } catch (const CLI::OptionNotFound&) {
        return checks;
    }
}

// The word that stands for the value, such as MS.
std::string value_name(const CLI::Option& option, const std::vector<std::string>& checks) {
    if (option.get_expected_max() == 0) return {};
    std::string name = option.get_type_name();
    for (auto check = checks.rbegin(); check != checks.rend(); ++check) {
        const std::string end = ":" + *check;
        if (!check->empty() && name.size() >= end.size() &&
            name.compare(name.size() - end.size(), end.size(), end) == 0)
            name.resize(name.size() - end.size());
    }
    return name;
}

// 0 where there is no terminal.
std::size_t terminal_columns() {
#ifdef TIOCGWINSZ
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) return size.ws_col;
#endif
    return 0;
}

}  // namespace

std::size_t help_width() {
    const char* columns = std::getenv("COLUMNS");
    const std::size_t given = columns != nullptr ? std::strtoul(columns, nullptr, 10) : 0;
    const std::size_t width = given > 0 ? given : terminal_columns();
    return width == 0 ? kUsual : std::clamp(width, kNarrowest, kWidest);
}

std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
    std::istringstream words(text);
    std::string word, result;
    std::size_t used = indent;
    while (words >> word) {
        const bool is_first = used == indent;
        if (!is_first && used + 1 + word.size() > width) {
            result += "\n" + std::string(indent, ' ');
            used = indent;
        } else if (!is_first) {
            result += ' ';
            ++used;
        }
        result += word;
        used += word.size();
    }
    return result;
}

std::string wrapped_paragraphs(const std::string& text, std::size_t width) {
    std::string result, paragraph;
    const auto end_paragraph = [&] {
        if (!paragraph.empty()) result += wrapped(paragraph, width, 0) + "\n";
        paragraph.clear();
    };
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (!line.empty() && line.compare(0, 2, "  ") != 0) {
            paragraph += line + " ";
            continue;
        }
        end_paragraph();
        result += line + "\n";
    }
    end_paragraph();
    return result;
}

std::string HelpText::entry(const std::string& name, const std::string& meaning) const {
    const bool is_narrow = width_ < kNarrow;
    const std::size_t column = is_narrow ? kIndent : kNameColumns;
    std::string line = "  " + name;
    if (is_narrow || line.size() + 2 > column)
        line += "\n" + std::string(column, ' ');
    else
        line.resize(column, ' ');
    return line + wrapped(meaning, width_, column) + "\n";
}

OptionHelp help_of(const CLI::Option& option) {
    const bool is_positional = option.get_positional();
    OptionHelp help{option.get_name(is_positional, !is_positional), option.get_description()};
    if (const std::size_t brace = help.name.find('{'); brace != std::string::npos)
        help.name.resize(brace);
    const std::vector<std::string> checks = checks_of(option);
    const std::string value = value_name(option, checks);
    if (!is_positional && !value.empty()) help.name += " " + value;
    for (const std::string& check : checks)
        if (const std::string range = range_in_words(check); !range.empty())
            help.meaning += " (" + range + ")";
    if (option.get_required()) help.meaning += "; required";
    const std::string& usual = option.get_default_str();
    if (!usual.empty() && help.meaning.find("efault") == std::string::npos)
        help.meaning += "; default: " + usual;
    return help;
}

std::string HelpText::make_option(const CLI::Option* option, bool) const {
    const OptionHelp help = help_of(*option);
    return entry(help.name, help.meaning);
}

std::string HelpText::make_subcommand(const CLI::App* command) const {
    return entry(command->get_display_name(true), command->get_description());
}

std::string HelpText::make_description(const CLI::App* app) const {
    return wrapped(app->get_description(), width_, 0) + "\n";
}

std::string HelpText::make_footer(const CLI::App* app) const {
    return wrapped_paragraphs(app->get_footer(), width_);
}

}  // namespace defrec::cli
