// How much memory this process holds.
#pragma once

namespace defrec::cli {

// Resident now, and the most that was resident since the start or the last reset; megabytes (10^6
// bytes).
double resident_megabytes();
double peak_megabytes();
// From here on the peak counts anew; where the system does not allow it, nothing changes.
void reset_peak_memory();

}  // namespace defrec::cli
