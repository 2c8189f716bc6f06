/* Tests: `make test`. */

#include "plugin.c"

#undef NDEBUG
#include <assert.h>

static void check(double number, const char *text, uint32_t severity) {
    Binding binding = {.limit_low = NAN, .limit_high = 95, .unit_len = 1, .unit = "A"};
    BusbarTagValue value = {.kind = BUSBAR_VALUE_F64};
    char into[MAX_PART];
    memcpy(&value.value, &number, sizeof number);
    size_t len = format(&value, &binding, into);
    assert(len == strlen(text) && memcmp(into, text, len) == 0);
    assert(judge(&value, &binding) == severity);
}

int main(void) {
    check(61.52, "61.52 A", BUSBAR_SEVERITY_NORMAL);
    check(95.1, "95.1 A", BUSBAR_SEVERITY_WARNING);
    check(-1e300, "-1e+300 A", BUSBAR_SEVERITY_NORMAL);
    assert(cut((const uint8_t *)"a\xc3\xb6", 3, 2) == 1);
    puts("4 tests passed");
    return 0;
}
