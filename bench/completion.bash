# SPDX-License-Identifier: Apache-2.0
# Completions for bash. Commands, options and the words that an option accepts come from --help-all.
_hotpath() {
  local current="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD - 1]}" help words word
  local -a command=()
  for word in "${COMP_WORDS[@]:1:COMP_CWORD - 1}"; do
    [[ "$word" == -* ]] && break
    "$1" "${command[@]}" "$word" --help > /dev/null 2>&1 && command+=("$word")
  done
  help=$("$1" "${command[@]}" --help-all 2> /dev/null) || return
  COMPREPLY=()
  if [[ "$current" == -* ]]; then
    words=$(grep -oE -- '--[a-z][a-z0-9-]*' <<< "$help")
  elif [[ "$before" == --* ]]; then
    words=$(grep -oE -- "^ +(-[a-z],)?$before(,--[a-z-]+)* [^ ]+" <<< "$help" \
      | sed -E 's/.* //; s/=.*//; s/\[:[A-Z]+\]//; s/[][]//g' | grep '|' | tr '|' '\n')
    if [[ "$before" == --executors ]]; then words=$("$1" list executors | cut -d' ' -f1); fi
  else
    words=$(sed -nE 's/^([A-Z][a-z ]{9}  | {12}|  )([a-z][a-z0-9-]*),? .*/\2/p' <<< "$help")
  fi
  while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -W "$words" -- "$current")
  if [[ ${#COMPREPLY[@]} -eq 0 ]]; then
    compopt -o filenames 2> /dev/null
    while IFS= read -r word; do COMPREPLY+=("$word"); done < <(compgen -f -- "$current")
  fi
}
complete -F _hotpath hotpath
