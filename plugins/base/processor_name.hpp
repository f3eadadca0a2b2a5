// What the processor is called.
#pragma once
#include <istream>
#include <string>

namespace defrec {

// The model that a text in the form of /proc/cpuinfo names; "Processor" where it names none.
std::string processor_name(std::istream& cpuinfo);
// That of this computer's first processor.
std::string processor_name();

}  // namespace defrec
