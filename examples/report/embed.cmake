# Writes `source`, which defines the functions of support/report/embedded_files.hpp as the files that are given
# by their names. Literals are short, because compilers have limits.
function(embed name file)
  file(READ ${file} text)
  string(LENGTH "${text}" length)
  set(code "const std::string& ${name}() {\n  static const std::string text = std::string()")
  set(first 0)
  while(first LESS length)
    string(SUBSTRING "${text}" ${first} 8000 part)
    string(APPEND code "\n      .append(R\"_embedded_(${part})_embedded_\")")
    math(EXPR first "${first} + 8000")
  endwhile()
  string(APPEND code ";\n  return text;\n}\n")
  file(APPEND ${source} "\n${code}")
endfunction()

file(WRITE ${source} "// Generated from examples/report/.\n#include \"support/report/embedded_files.hpp\"\n\n"
                     "namespace globalmatch::support {\n")
embed(report_style ${report_style})
embed(report_script ${report_script})
file(APPEND ${source} "\n}  // namespace globalmatch::support\n")
