// report.json: a run as JSON, and back. report.schema.json says what is in it.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "conformance/worker/record.hpp"

namespace defrec::conformance {

inline constexpr int kReportFormat = 1;  // grows with every incompatible change

// The file, with the digests of itself and of the two others. Texts must be valid (text.hpp).
std::string report_text(const RunRecord& run, const std::string& junit, const std::string& page);

// A report as it stands in its file: each case in a line of its own, so that two reports can be
// compared by lines, and each other member in one.
std::string file_text(const nlohmann::json& report);

// SHA-256 of the canonical content: the report without "digests", members sorted by name, no white
// space, numbers in their shortest form.
std::string content_digest(nlohmann::json report);

// The run behind a report. Strict: every member must be there, of the right type, and nothing else;
// counts must follow from the cases. Pictures come back without pixels. Throws ReportError.
RunRecord record_of(const nlohmann::json& report);

}  // namespace defrec::conformance
