// One line of a table as text.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sdk/evaluation/score/error_summary.hpp"

namespace defrec::cli {

// A name on the left, then columns on their right edges. NaN is shown as -.
class TableLine {
  public:
    explicit TableLine(const std::string& name);
    TableLine& text(const std::string& column);
    TableLine& count(std::size_t value);
    TableLine& number(double value, int decimals);
    TableLine& percent(double share);
    std::string end() const { return text_ + "\n"; }

  private:
    std::string text_;
};

std::string table_header(const std::string& name, const std::vector<std::string>& columns);

// In a sentence. what: "visible points"; of `rows` of them so many have no position, and at least
// one has.
std::string verdict_on(const std::string& what, const ErrorSummary& errors, std::size_t lost,
                       std::size_t rows);

}  // namespace defrec::cli
