// How far results of the float stages may lie from the reference's: tolerances.yaml, compiled in.
#pragma once
#include <map>
#include <string>
#include <string_view>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

struct Tolerance {
    std::string unit;
    double maximum = 0, p99 = 0;
    std::string provenance;  // what the numbers were derived from, and how
    std::string command;     // that derived them
};

class Tolerances {
  public:
    // Throws Error with the line where the text is not a list of tolerances.
    static Tolerances parse(std::string_view yaml);
    // The suite's own.
    static const Tolerances& of_suite();

    // quantity: "warp.position". Throws Error if there is none of that name.
    const Tolerance& at(const std::string& quantity) const;
    const std::map<std::string, Tolerance>& all() const { return all_; }

  private:
    std::map<std::string, Tolerance> all_;
};

}  // namespace defrec::conformance
