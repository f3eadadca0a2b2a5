// Frames as OpenIGTLink messages. What is sent and under which names: docs/program/live_link.md.
#pragma once

#include <string>

#include "sdk/live_link/frame.hpp"

namespace defrec::cli {

// The whole messages of one frame in the order of sending, header version 1: STATUS always and
// first, and IMAGE where it was asked for; with geometry to be trusted TRANSFORM, then POLYDATA
// unless the surface is empty or inconsistent, then POINT unless every point is lost, then POINT
// and POLYDATA of the targets unless every one is lost, then POLYDATA of each part of the plan and
// POINT of its targets, of those that are not lost.
std::string pack_messages(const LinkFrame& frame);

}  // namespace defrec::cli
