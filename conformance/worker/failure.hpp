// How a case ends before its end.
#pragma once
#include <stdexcept>

#include "sdk/base/util/error.hpp"

namespace defrec::conformance {

// Ends a case as failed; what() is the reason, one error message.
class CaseFailure : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};
// Ends a case that does not apply.
class CaseSkipped : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

template <class... Pieces>
[[noreturn]] void fail_case(const Pieces&... pieces) {
    throw CaseFailure(concat(pieces...));
}
template <class... Pieces>
[[noreturn]] void skip_case(const Pieces&... pieces) {
    throw CaseSkipped(concat(pieces...));
}
// The reason is what was expected and what was found instead.
template <class... Pieces>
void require(bool holds, const Pieces&... pieces) {
    if (!holds) fail_case(pieces...);
}

}  // namespace defrec::conformance
