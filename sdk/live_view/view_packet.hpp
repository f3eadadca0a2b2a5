// The answers of the live view to its page: a JSON header and binary arrays in one body.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace defrec::cli {

// Little-endian: the header's length (uint32), the header, then each section, all filled up to a
// multiple of 4 bytes, the header with blanks, sections with zeros. The header's member `sections`
// is an array of [name, bytes] in their order, bytes without what fills up.
class ViewPacket {
  public:
    // A copy of `count` values.
    template <class T>
    void add(std::string name, const T* values, std::size_t count) {
        sections_.emplace_back(
            std::move(name), std::string(reinterpret_cast<const char*>(values), count * sizeof(T)));
    }
    // header: the text of a JSON object without a member `sections`.
    std::string body(std::string_view header) const;

  private:
    std::vector<std::pair<std::string, std::string>> sections_;
};

}  // namespace defrec::cli
