// For tests: how a faulty input is refused.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/exit_code.hpp"
#include "sdk/testing/check_says.hpp"

namespace defrec::cli {

// The message of `read` where it throws, with that code; "accepted" where it does not.
template <typename Function>
std::string refusal_of(const Function& read, ExitCode code = ExitCode::kInput) {
    try {
        read();
    } catch (const CliError& error) {
        CHECK(error.code() == code);
        return error.what();
    }
    return "accepted";
}

}  // namespace defrec::cli
