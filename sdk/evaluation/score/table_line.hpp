// One line of a table as text.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

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

}  // namespace defrec::cli
