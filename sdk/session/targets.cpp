// targets.csv as input.
#include "sdk/session/targets.hpp"

#include <string>

#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

std::vector<Target> read_targets(const std::filesystem::path& path) {
    CsvReader csv(path, {"id", "x", "y", "z"}, {"depth"});
    std::vector<Target> targets;
    UniqueIds ids;
    while (csv.next()) {
        if (targets.size() == kMaxTargets) {
            csv.fail("the file has more than " + std::to_string(kMaxTargets) +
                     " targets, which is the most that are followed.");
        }
        Target target{csv.integer(0), {csv.number(1), csv.number(2), csv.number(3)}};
        if (!csv.is_empty(4)) target.depth = csv.number(4);
        ids.add(csv, target.id);
        if (target.xyz[2] <= 0) {
            csv.fail("z is " + format_fixed(target.xyz[2], 2) +
                     "; more than 0 was expected, in front of the camera.");
        }
        targets.push_back(target);
    }
    if (targets.empty()) csv.fail("the file names no target.");
    return targets;
}

}  // namespace defrec::cli
