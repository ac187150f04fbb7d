// Text in XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace globalmatch::support {

/// Any text as that of an element or, in quotes of either kind, of an attribute. Control characters become
/// blanks, because XML has none.
std::string escaped(std::string_view text);

}  // namespace globalmatch::support
