#include "plugins/base/processor_name.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <sstream>

namespace {

std::string name_in(const std::string& text) {
    std::istringstream cpuinfo(text);
    return defrec::processor_name(cpuinfo);
}

}  // namespace

TEST_CASE("a processor is called what the system says its model is") {
    CHECK(name_in("processor\t: 0\nmodel\t\t: 1\nmodel name\t: AMD EPYC 7763 64-Core Processor  \n"
                  "processor\t: 1\nmodel name\t: another\n") == "AMD EPYC 7763 64-Core Processor");
    CHECK(name_in("model name : A: B") == "A: B");
}

TEST_CASE("where no model is named, it is a processor") {
    CHECK(name_in("") == "Processor");
    CHECK(name_in("processor\t: 0\nBogoMIPS\t: 50.00\nmodel name\t: \n") == "Processor");
    std::ifstream missing("/nonexistent");
    CHECK(defrec::processor_name(missing) == "Processor");
}
