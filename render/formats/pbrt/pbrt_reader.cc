#include "render/formats/pbrt/pbrt_reader.h"

#include "render/formats/pbrt/directives.h"
#include "render/formats/pbrt/tokenizer.h"

namespace lucerna {

bool BeginsAsPbrt(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  Diagnostics diagnostics;
  Tokenizer tokens(diagnostics.NameOfFile(""), text, diagnostics);
  const Token& first = tokens.Peek();
  return first.kind == Token::Kind::kWord && IsDirective(first.text);
}

UnfinishedScene ReadPbrt(const std::string& main_path, std::string_view text, AssetReader& assets,
                         Diagnostics& diagnostics) {
  return DirectiveReader(assets, diagnostics).Read(main_path, text);
}

}  // namespace lucerna
