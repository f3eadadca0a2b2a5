// The text of --help: as wide as the terminal, with units, ranges and defaults in words.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

namespace defrec::cli {

// Columns of the terminal, 80 where there is none; 40 to 120.
std::size_t help_width();

// Words from the first column on in lines of at most `width`, further lines after `indent` blanks.
// A word that is longer stands in a line of its own.
std::string wrapped(const std::string& text, std::size_t width, std::size_t indent);

// Paragraphs of lines that belong together; lines that begin with two blanks stay as they are.
std::string wrapped_paragraphs(const std::string& text, std::size_t width);

// An option as its user knows it: "--deadline MS", with range and default in words.
struct OptionHelp {
    std::string name, meaning;
};
OptionHelp help_of(const CLI::Option& option);

class HelpText : public CLI::Formatter {
  public:
    explicit HelpText(std::size_t width) : width_(width) {}
    std::string make_option(const CLI::Option* option, bool is_positional) const override;
    std::string make_subcommand(const CLI::App* command) const override;
    std::string make_description(const CLI::App* app) const override;
    std::string make_footer(const CLI::App* app) const override;

  private:
    // A name with what it means beside it, or below where the terminal is narrow.
    std::string entry(const std::string& name, const std::string& meaning) const;

    std::size_t width_;
};

}  // namespace defrec::cli
