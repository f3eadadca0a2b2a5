// The name of a processor in a text.
#pragma once
#include <istream>
#include <string>

namespace defrec {

// The model that a text in the form of /proc/cpuinfo names; "Processor" where it names none.
std::string processor_name(std::istream& cpuinfo);

}  // namespace defrec
