/* Prints how many plugins a context finds that honours DEFREC_PLUGIN_PATH. Its test runs it with
 * another owner's rights. */
#include <stdio.h>

#include "include/defrec_c.h"

int main(void) {
    defrec_context_desc desc;
    defrec_context context = NULL;
    size_t i, from_environment = 0;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_USE_ENVIRONMENT;
    desc.threads = 1;
    if (defrec_context_create(&desc, &context) != DEFREC_OK) return 1;
    for (i = 0; i < defrec_plugin_count(context); ++i) {
        defrec_plugin_info info;
        DEFREC_INIT(&info);
        if (defrec_plugin_get(context, i, &info) == DEFREC_OK && strcmp(info.name, "good") == 0)
            ++from_environment;
    }
    printf("%u\n", (unsigned)from_environment);
    defrec_context_destroy(context);
    return 0;
}
