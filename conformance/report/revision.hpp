// The source tree that this program was built from.
#pragma once
#include <string>

namespace defrec::conformance {

struct Revision {
    std::string id;  // 40 hexadecimal digits; "unknown" when not built inside the project's own git
                     // repository
    bool dirty = false;  // the tree had changes that id does not name
};
Revision suite_revision();

}  // namespace defrec::conformance
