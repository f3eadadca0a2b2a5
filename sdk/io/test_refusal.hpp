// For tests: how a faulty input is refused.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

// What `read` says where it throws, which must be of the input; "accepted" where it does not.
template <typename Function>
std::string refusal_of(const Function& read) {
    try {
        read();
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kInput);
        return error.what();
    }
    return "accepted";
}

#define CHECK_SAYS(message, part) \
    CHECK_MESSAGE((message).find(part) != std::string::npos, (message))

}  // namespace defrec::cli
