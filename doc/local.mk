# nodes.md, the manual page and the completion are generated: make regen.
dist_doc_DATA += \
  doc/architecture.md \
  doc/language.md \
  doc/nodes.md
dist_man_MANS = doc/zeroset.1
bashcompletiondir = $(datadir)/bash-completion/completions
dist_bashcompletion_DATA = doc/zeroset.bash
