// Contexts for tests of the C API, destroyed with the object.
#pragma once
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::test {

// A context that looks for plugins nowhere but in the given places.
class TestContext {
  public:
    explicit TestContext(const std::vector<std::string>& places = {}, uint32_t threads = 1) {
        defrec_context_desc desc;
        DEFREC_INIT(&desc);
        set_places(desc, places);
        desc.threads = threads;
        const defrec_status status = defrec_context_create(&desc, &handle_);
        INFO(defrec_last_error());
        REQUIRE(status == DEFREC_OK);
    }
    explicit TestContext(const defrec_context_desc& desc) {
        REQUIRE(defrec_context_create(&desc, &handle_) == DEFREC_OK);
    }
    ~TestContext() { defrec_context_destroy(handle_); }
    TestContext(const TestContext&) = delete;
    TestContext& operator=(const TestContext&) = delete;

    defrec_context get() const { return handle_; }

    defrec_plugin_info plugin(size_t index) const {
        defrec_plugin_info info;
        DEFREC_INIT(&info);
        REQUIRE(defrec_plugin_get(handle_, index, &info) == DEFREC_OK);
        return info;
    }

  private:
    void set_places(defrec_context_desc& desc, const std::vector<std::string>& places) {
        for (const std::string& place : places) pointers_.push_back(place.c_str());
        desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        desc.plugin_paths = pointers_.data();
        desc.plugin_path_count = pointers_.size();
    }
    std::vector<const char*> pointers_;
    defrec_context handle_ = nullptr;
};

inline bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace defrec::test
