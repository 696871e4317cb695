class IfCondition:
    def __init__(self, predicate_expression) -> None:
        self.expression = predicate_expression

    def evaluate(self, context) -> bool:
        return self.expression.perform(context).lower() in ('true', '1')
