// The list of the abi tier, and what its cases share.
#include "conformance/cases/abi/abi.hpp"

#include <cstring>

namespace defrec::conformance {

void add_abi_stage_case(std::vector<Case>& cases, const char* name, const char* title,
                        const std::function<void(CaseRun&, uint32_t stage)>& body, uint32_t first,
                        uint32_t end) {
    for (uint32_t stage = first; stage < end; ++stage) {
        Case one{concat("abi/", name, "/", stage_name(stage)),
                 "abi",
                 stage_name(stage),
                 title,
                 true,
                 false,
                 {}};
        one.body = [body, stage](CaseRun& run) {
            run.subject().stage_table(stage);
            body(run, stage);
        };
        cases.push_back(std::move(one));
    }
}

void require_refused(const Instance& instance, const std::string& call, defrec_status status) {
    const std::string message = instance.host().take_error();
    require(status < 0, call, " answered ", defrec_status_name(status), ", a refusal expected");
    require(std::strcmp(defrec_status_name(status), "unknown status") != 0, call, " answered ",
            status, ", which is no status");
    require(!message.empty(), call, " answered ", defrec_status_name(status),
            " without telling the host an error message");
}
void require_refused(const Session& session, const std::string& call, defrec_status status) {
    require_refused(session.instance(), call, status);
}

Bytes pattern_bytes(size_t size, uint64_t seed) {
    Bytes bytes(size);
    Random random(seed);
    for (std::byte& byte : bytes) byte = std::byte(uint8_t(random.next() >> 32));
    return bytes;
}

void add_abi_cases(std::vector<Case>& cases) {
    add_abi_entry_cases(cases);
    add_abi_device_cases(cases);
    add_abi_buffer_cases(cases);
    add_abi_memory_cases(cases);
    add_abi_queue_cases(cases);
    add_abi_stage_cases(cases);
    add_abi_template_cases(cases);
    add_abi_thread_cases(cases);
    add_abi_life_cases(cases);
}

}  // namespace defrec::conformance
