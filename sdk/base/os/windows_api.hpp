// Windows' own headers, in the order that they need, without the macros that break others.
#pragma once
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
#ifndef _WIN32_WINNT
#define _WIN32_WINNT 0x0A00
#endif
// clang-format off: the others need it first
#include <windows.h>
// clang-format on
#include <aclapi.h>
#include <psapi.h>
#include <tlhelp32.h>
